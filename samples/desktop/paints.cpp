#include "paints.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace desktop {
namespace {

using Bytes = std::span<const unsigned char>;

constexpr std::array<unsigned char, 8> kPng = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::size_t kPngHead_bytes = 24;  // signature, and length, name, width and height of the first chunk

struct Size {
  std::uint32_t width = 0, height = 0;
};

// A number of `bytes` bytes that is there, the highest first.
std::uint32_t BigEndian(Bytes file, std::size_t at, std::size_t bytes) {
  std::uint32_t value = 0;
  for (const unsigned char byte : file.subspan(at, bytes)) value = value << 8 | byte;
  return value;
}

// Segments follow each other, each with its length, up to the frame's.
std::optional<Size> SizeOfJpeg(Bytes file) {
  for (std::size_t at = 2; at + 9 <= file.size() && file[at] == 0xff;) {
    const unsigned kind = file[at + 1];
    if (kind == 0xff) {
      ++at;  // it is filled up
      continue;
    }
    // Frames but for those numbers, which are tables (ITU T.81, table B.1).
    if (kind >= 0xc0 && kind <= 0xcf && kind != 0xc4 && kind != 0xc8 && kind != 0xcc) {
      return Size{BigEndian(file, at + 7, 2), BigEndian(file, at + 5, 2)};
    }
    at += 2 + BigEndian(file, at + 2, 2);
  }
  return std::nullopt;
}

// Nothing for a file that is neither PNG nor JPEG, or has no whole head.
std::optional<Size> SizeOf(Bytes file) {
  if (file.size() >= kPngHead_bytes && std::equal(kPng.begin(), kPng.end(), file.begin())) {
    return Size{BigEndian(file, 16, 4), BigEndian(file, 20, 4)};
  }
  if (file.size() >= 4 && file[0] == 0xff && file[1] == 0xd8) return SizeOfJpeg(file);
  return std::nullopt;
}

template <class T>
const T* At(const std::vector<T>& list, int index) {
  return index >= 0 && static_cast<std::size_t>(index) < list.size() ? &list[static_cast<std::size_t>(index)] : nullptr;
}

// The file of an image; empty if it is not there.
Bytes FileOf(const tinygltf::Model& model, int image) {
  const tinygltf::Image* const found = At(model.images, image);
  const tinygltf::BufferView* const view = found == nullptr ? nullptr : At(model.bufferViews, found->bufferView);
  const tinygltf::Buffer* const buffer = view == nullptr ? nullptr : At(model.buffers, view->buffer);
  if (buffer == nullptr || view->byteOffset > buffer->data.size() ||
      view->byteLength > buffer->data.size() - view->byteOffset) {
    return {};
  }
  return Bytes(buffer->data).subspan(view->byteOffset, view->byteLength);
}

// Half as wide and high, each pixel the mean of four.
Paint Halved(const Paint& from) {
  Paint half{std::max(1, from.width / 2), std::max(1, from.height / 2), {}};
  half.rgb.reserve(static_cast<std::size_t>(half.width) * static_cast<std::size_t>(half.height) * 3);
  const auto part = [&](int x, int y, std::size_t k) {
    const int row = std::min(y, from.height - 1);
    const auto column = static_cast<std::size_t>(std::min(x, from.width - 1));
    const std::size_t pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(from.width) + column;
    return static_cast<int>(from.rgb[3 * pixel + k]);
  };
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      for (std::size_t k = 0; k < 3; ++k) {
        const int sum = part(2 * x, 2 * y, k) + part(2 * x + 1, 2 * y, k) + part(2 * x, 2 * y + 1, k) +
                        part(2 * x + 1, 2 * y + 1, k);
        half.rgb.push_back(static_cast<unsigned char>(sum / 4));
      }
    }
  }
  return half;
}

}  // namespace

std::string ReadPaint(const tinygltf::Model& model, int image, Paint& paint) {
  const Bytes file = FileOf(model, image);
  const std::optional<Size> size = SizeOf(file);
  if (!size) return "is no PNG or JPEG file";
  if (size->width > kMostFileSide || size->height > kMostFileSide) return "has more than 4096 pixels along one side";
  tinygltf::Image decoded;
  std::string error, warning;
  // Four parts a pixel.
  if (!tinygltf::LoadImageData(&decoded, image, &error, &warning, 0, 0, file.data(), static_cast<int>(file.size()),
                               nullptr)) {
    return "is damaged";
  }
  const std::size_t bytes = static_cast<std::size_t>(decoded.bits) / 8;
  const std::size_t pixels = static_cast<std::size_t>(decoded.width) * static_cast<std::size_t>(decoded.height);
  const auto parts = static_cast<std::size_t>(decoded.component);
  if (parts < 3 || bytes < 1 || decoded.image.size() < pixels * parts * bytes) return "is damaged";
  paint = {decoded.width, decoded.height, {}};
  paint.rgb.reserve(pixels * 3);
  for (std::size_t i = 0; i < pixels; ++i) {
    // The higher byte of two comes last.
    for (std::size_t k = 0; k < 3; ++k) paint.rgb.push_back(decoded.image[((i * parts + k) + 1) * bytes - 1]);
  }
  while (paint.width > kMostPaintSide || paint.height > kMostPaintSide) paint = Halved(paint);
  return "";
}

}  // namespace desktop
