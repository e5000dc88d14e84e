#include "cli/gltf/gltf_textures.h"

#include <tiny_gltf.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace tessera::cli {
namespace {

constexpr char kPng[] = "\x89PNG\r\n\x1a\n";
constexpr std::size_t kPngHead_bytes = 24;  // signature, and length, name, width and height of the first chunk

struct Size {
  std::uint32_t width = 0, height = 0;
};

// A number of `bytes` bytes that is there, the highest first.
std::uint32_t BigEndian(const std::string& file, std::size_t at, std::size_t bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | static_cast<std::uint8_t>(file[at + i]);
  return value;
}

std::optional<Size> SizeOfPng(const std::string& file) {
  if (file.size() < kPngHead_bytes) return std::nullopt;
  return Size{BigEndian(file, 16, 4), BigEndian(file, 20, 4)};
}

// Segments follow each other, each with its length, up to the frame's.
std::optional<Size> SizeOfJpeg(const std::string& file) {
  for (std::size_t at = 2; at + 9 <= file.size() && BigEndian(file, at, 1) == 0xff;) {
    const std::uint32_t kind = BigEndian(file, at + 1, 1);
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

}  // namespace

// A picture that is missing or damaged is no fault of the level: it is said where it would be drawn. Pictures in
// buffers are read later, for tinygltf does not check where these end.
bool KeepPicture(tinygltf::Image* image, int number, std::string* /*error*/, std::string* /*warning*/, int /*width*/,
                 int /*height*/, const unsigned char* bytes, int size, void* pictures) {
  if (image->bufferView < 0 && bytes != nullptr && size > 0) {
    (*static_cast<Pictures*>(pictures))[number].assign(reinterpret_cast<const char*>(bytes),
                                                       static_cast<std::size_t>(size));
  }
  return true;
}

std::string PictureFile(const tinygltf::Model& model, const Pictures& beside, int image) {
  const auto found = beside.find(image);
  if (found != beside.end()) return found->second;
  if (image < 0 || static_cast<std::size_t>(image) >= model.images.size()) return "";
  const int number = model.images[static_cast<std::size_t>(image)].bufferView;
  if (number < 0 || static_cast<std::size_t>(number) >= model.bufferViews.size()) return "";
  const tinygltf::BufferView& view = model.bufferViews[static_cast<std::size_t>(number)];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model.buffers.size()) return "";
  const std::vector<unsigned char>& data = model.buffers[static_cast<std::size_t>(view.buffer)].data;
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset) return "";
  const auto begin = data.begin() + static_cast<std::ptrdiff_t>(view.byteOffset);
  return {begin, begin + static_cast<std::ptrdiff_t>(view.byteLength)};
}

absl::StatusOr<PictureKind> CheckPicture(const std::string& file, std::size_t most_pixels) {
  const bool png = absl::StartsWith(file, kPng), jpeg = absl::StartsWith(file, "\xff\xd8\xff");
  if (!png && !jpeg) return absl::InvalidArgumentError("is no PNG or JPEG file");
  const std::optional<Size> size = png ? SizeOfPng(file) : SizeOfJpeg(file);
  if (!size) return absl::InvalidArgumentError("is damaged: its head has no size");
  if (size->width > kMaxPictureSide || size->height > kMaxPictureSide) {
    return absl::InvalidArgumentError(absl::StrCat("has ", size->width, " x ", size->height, " pixels, more than ",
                                                   kMaxPictureSide, " along one side"));
  }
  const std::size_t pixels = std::size_t{size->width} * size->height;
  if (pixels > most_pixels) {
    return absl::InvalidArgumentError(
        absl::StrCat("and those before it have more than ", kMaxPicturePixels, " pixels together"));
  }
  tinygltf::Image image;
  std::string error, warning;
  const auto* const bytes = reinterpret_cast<const unsigned char*>(file.data());
  if (!tinygltf::LoadImageData(&image, 0, &error, &warning, 0, 0, bytes, static_cast<int>(file.size()), nullptr)) {
    return absl::InvalidArgumentError("is damaged: it cannot be decoded");
  }
  return PictureKind{png ? "image/png" : "image/jpeg", pixels};
}

}  // namespace tessera::cli
