// Pictures that meshes are painted with: PNG and JPEG files of a glTF model, looked at before anybody draws them.
//
//   Pictures beside;                                      // filled while the model is loaded
//   loader.SetImageLoader(KeepPicture, &beside);
//   const std::string file = PictureFile(model, beside, image);
//   absl::StatusOr<PictureKind> kind = CheckPicture(file, kMaxPicturePixels);
//
// Thread rule: free functions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "absl/status/statusor.h"

namespace tinygltf {
struct Image;
class Model;
}  // namespace tinygltf

namespace tessera::cli {

// Files that do not lie in the model's buffers, by their number among its images.
using Pictures = std::map<int, std::string>;

// A picture of more pixels along one side is not kept, nor more than so many in a file: the page and the desktop client
// draw as many, each scaled down to what they have room for.
inline constexpr std::uint32_t kMaxPictureSide = 4096;
inline constexpr std::size_t kMaxPictures = 64;
// Pictures of a level are decoded up to so many pixels together, those of 32 of 2048 x 2048.
inline constexpr std::size_t kMaxPicturePixels = std::size_t{1} << 27;

struct PictureKind {
  const char* type = nullptr;  // "image/png"
  std::size_t pixels = 0;
};

// A tinygltf::LoadImageDataFunction that keeps in `pictures`, which are Pictures, what comes from outside of buffers.
bool KeepPicture(tinygltf::Image* image, int number, std::string* error, std::string* warning, int width, int height,
                 const unsigned char* bytes, int size, void* pictures);

// The bytes of an image of the model; empty if they cannot be had.
std::string PictureFile(const tinygltf::Model& model, const Pictures& beside, int image);

// Decodes the file. INVALID_ARGUMENT says why not: it is no PNG or JPEG file, is damaged, or has more than
// kMaxPictureSide pixels along one side, or more than `most_pixels` in all.
absl::StatusOr<PictureKind> CheckPicture(const std::string& file, std::size_t most_pixels);

}  // namespace tessera::cli
