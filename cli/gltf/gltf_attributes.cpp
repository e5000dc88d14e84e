#include "cli/gltf/gltf_attributes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "cli/gltf/gltf_values.h"

namespace tessera::cli {
namespace {

absl::Status AttributeFault(const std::string& where, const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat(where, ": ", what));
}

// Numbers of an attribute, so many for each vertex: floats, or integers that stand for 0 to 1. Empty where there are
// none that could be used.
std::vector<float> NumbersOf(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                             const std::string& name, int type, std::size_t count) {
  const auto attribute = primitive.attributes.find(name);
  if (attribute == primitive.attributes.end()) return {};
  const auto elements = ElementsOf(model, attribute->second, type, name);
  if (!elements.ok() || elements->count != count) return {};
  const auto parts = static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type)));
  std::vector<float> numbers;
  numbers.reserve(count * parts);
  for (std::size_t i = 0; i < count * parts; ++i) {
    const unsigned char* const at = elements->bytes.data() + i / parts * elements->stride;
    float number = 0;
    if (elements->component == TINYGLTF_COMPONENT_TYPE_FLOAT) {
      std::memcpy(&number, at + i % parts * sizeof number, sizeof number);
    } else if (elements->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) {
      number = static_cast<float>(at[i % parts]) / 0xff;
    } else if (elements->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) {
      std::uint16_t value = 0;
      std::memcpy(&value, at + i % parts * sizeof value, sizeof value);
      number = static_cast<float>(value) / 0xffff;
    } else {
      return {};
    }
    if (!std::isfinite(number)) return {};
    numbers.push_back(number);
  }
  return numbers;
}

}  // namespace

absl::StatusOr<Elements> ElementsOf(const tinygltf::Model& model, int index, int type, const std::string& where) {
  const tinygltf::Accessor* const accessor = At(model.accessors, index);
  if (accessor == nullptr) return AttributeFault(where, absl::StrCat("there is no accessor ", index));
  const std::string here = absl::StrCat(where, ": accessor ", index);
  if (accessor->sparse.isSparse) return AttributeFault(here, "is sparse, which is not supported");
  if (accessor->type != type) return AttributeFault(here, "has elements of another type");
  const tinygltf::BufferView* const view = At(model.bufferViews, accessor->bufferView);
  if (view == nullptr) return AttributeFault(here, absl::StrCat("there is no buffer view ", accessor->bufferView));
  const tinygltf::Buffer* const buffer = At(model.buffers, view->buffer);
  if (buffer == nullptr) return AttributeFault(here, absl::StrCat("there is no buffer ", view->buffer));
  const int component_bytes = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor->componentType));
  const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type));
  if (component_bytes <= 0 || components <= 0) return AttributeFault(here, "has components of an unknown type");
  const std::size_t element = static_cast<std::size_t>(component_bytes) * static_cast<std::size_t>(components);
  Elements elements{{}, accessor->count, view->byteStride == 0 ? element : view->byteStride, accessor->componentType};
  if (elements.stride < element || elements.stride > 255) return AttributeFault(here, "has a wrong stride");
  if (elements.count == 0) return elements;
  const std::size_t size = buffer->data.size();
  if (view->byteOffset > size || view->byteLength > size - view->byteOffset) {
    return AttributeFault(here, absl::StrCat("its buffer view ends beyond its buffer of ", size, " bytes"));
  }
  // A count that would overflow is larger than any buffer.
  if (elements.count > size || accessor->byteOffset > view->byteLength ||
      (elements.count - 1) * elements.stride + element > view->byteLength - accessor->byteOffset) {
    return AttributeFault(
        here, absl::StrCat(elements.count, " elements end beyond its buffer view of ", view->byteLength, " bytes"));
  }
  elements.bytes = std::span(buffer->data).subspan(view->byteOffset + accessor->byteOffset);
  return elements;
}

std::vector<Vec3f> ColoursOf(const tinygltf::Model& model, const tinygltf::Primitive& primitive, std::size_t count) {
  std::size_t parts = 3;
  std::vector<float> numbers = NumbersOf(model, primitive, "COLOR_0", TINYGLTF_TYPE_VEC3, count);
  if (numbers.empty()) {
    parts = 4;  // with how opaque it is, which is left out
    numbers = NumbersOf(model, primitive, "COLOR_0", TINYGLTF_TYPE_VEC4, count);
  }
  std::vector<Vec3f> colours;
  colours.reserve(numbers.size() / parts);
  for (std::size_t i = 0; i + parts <= numbers.size(); i += parts) {
    const auto part = [&](std::size_t k) { return std::clamp(numbers[i + k], 0.0F, 1.0F); };
    colours.push_back({part(0), part(1), part(2)});
  }
  return colours;
}

std::vector<std::array<float, 2>> PlacesOf(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                           std::size_t count) {
  const tinygltf::Material* const material = At(model.materials, primitive.material);
  if (material == nullptr || material->pbrMetallicRoughness.baseColorTexture.index < 0) return {};
  const tinygltf::TextureInfo& picture = material->pbrMetallicRoughness.baseColorTexture;
  int set = picture.texCoord;
  std::array<double, 2> offset{0, 0}, scale{1, 1};
  double turn = 0;
  if (const auto found = picture.extensions.find("KHR_texture_transform"); found != picture.extensions.end()) {
    const tinygltf::Value& transform = found->second;
    const auto pair = [&](const char* key, std::array<double, 2>& value) {
      const tinygltf::Value& list = MemberOf(transform, key);
      for (std::size_t i = 0; list.IsArray() && i < value.size() && i < list.ArrayLen(); ++i) {
        const tinygltf::Value& part = list.Get(static_cast<int>(i));
        if (part.IsNumber()) value[i] = part.GetNumberAsDouble();
      }
    };
    pair("offset", offset);
    pair("scale", scale);
    turn = NumberIn(transform, "rotation", 0);
    if (const int other = IndexIn(transform, "texCoord"); other >= 0) set = other;
  }
  const std::vector<float> numbers =
      NumbersOf(model, primitive, absl::StrCat("TEXCOORD_", set), TINYGLTF_TYPE_VEC2, count);
  std::vector<std::array<float, 2>> places;
  places.reserve(numbers.size() / 2);
  for (std::size_t i = 0; i + 2 <= numbers.size(); i += 2) {
    const double u = numbers[i] * scale[0], v = numbers[i + 1] * scale[1];
    const std::array<float, 2> place = {static_cast<float>(std::cos(turn) * u + std::sin(turn) * v + offset[0]),
                                        static_cast<float>(std::cos(turn) * v - std::sin(turn) * u + offset[1])};
    if (!std::isfinite(place[0]) || !std::isfinite(place[1])) return {};
    places.push_back(place);
  }
  return places;
}

}  // namespace tessera::cli
