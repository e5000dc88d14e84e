// Paints: the pictures that meshes of a glTF file are painted with, decoded, and scaled down to what is drawn of them.
//
// Thread rule: free functions; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace tinygltf {
class Model;
}

namespace desktop {

// Pixels of a picture from the upper left, as a screen shows them (sRGB).
struct Paint {
  int width = 0, height = 0;
  std::vector<unsigned char> rgb;  // three a pixel
};

// A file of more pixels along one side is not decoded; one of more than kMostPaintSide is drawn smaller. So a paint
// takes 768 kB at the most, and the kMostPaints of a file 48 MB.
inline constexpr std::uint32_t kMostFileSide = 4096;
inline constexpr int kMostPaintSide = 512;
inline constexpr std::size_t kMostPaints = 64;

// The image of this number. Gives why it cannot be had, empty if all is well.
std::string ReadPaint(const tinygltf::Model& model, int image, Paint& paint);

}  // namespace desktop
