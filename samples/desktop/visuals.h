// Visuals: the meshes that shapes are drawn with, out of binary glTF files that lie in a folder under their SHA-256, as
// `tessera scene import` writes them, or that a gateway has.
//
//   Visuals visuals("visuals", "http://127.0.0.1:7710");
//   const std::vector<Painted> meshes = visuals.MeshesOf(shape);   // empty: it is drawn as the shape that it is
//   for (const std::string& problem : visuals.TakeProblems()) ...  // each once
//   every frame: if (visuals.Advance()) ...;                       // files have come: shapes look otherwise from now
//   on
//
// Thread rule: one thread. A file is read whole when it is first needed, and kept. Until one comes from the gateway its
// shapes are drawn.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "downloads.h"
#include "meshes.h"
#include "paints.h"
#include "tessera/tessera.hpp"
#include "vectors.h"

namespace desktop {

// Triangles in the shape's frame, with their colours, and the picture that these are multiplied with; null: none.
struct Painted {
  Mesh mesh;
  std::shared_ptr<const Paint> paint;
};

// A file that is larger is not read, and no more triangles are drawn of one.
inline constexpr std::size_t kMaxVisualFile_bytes = std::size_t{64} << 20, kMaxVisualTriangles = 1'000'000;

struct VisualFile;  // as it was read

class Visuals {
 public:
  // `folder` comes first, and both may be empty: then every shape is drawn as it is, and nothing is said. `page` is
  // the address of a gateway.
  explicit Visuals(std::string folder, const std::string& page = "");
  ~Visuals();

  // All meshes of these visuals, or none if one of them cannot be had.
  std::vector<Painted> MeshesOf(const std::vector<tessera::VisualInfo>& visuals);
  bool coming() const { return downloads_.under_way(); }
  // True: files have come that were on their way.
  bool Advance();
  std::vector<std::string> TakeProblems() { return std::move(problems_); }

 private:
  VisualFile* Open(const std::string& sha256);
  bool Read(const std::string& name, const std::string& sha256, const std::string& bytes);
  std::shared_ptr<const Paint> PaintOf(VisualFile& file, const std::string& sha256, int material);
  void Complain(const std::string& text, const std::string& instead);

  std::string folder_;
  Downloads downloads_;
  std::map<std::string, std::unique_ptr<VisualFile>> files_;  // by hash; null: it cannot be had, or not yet
  std::set<std::string> said_;
  std::vector<std::string> problems_;
};

}  // namespace desktop
