// Renderer: draws many copies of a few meshes, lit by one sun that casts shadows. One call a mesh, whatever the number
// of copies.
//
//   Renderer renderer(gl, true);
//   const std::size_t box = renderer.Add(MeshOf(info, 0));
//   Picture picture;  picture.copies[box].push_back(...);     // each frame
//   renderer.Draw(picture, width, height);
//
// Thread rule: the thread of the OpenGL context.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "gl.h"
#include "meshes.h"
#include "paints.h"

namespace desktop {

// As the vertex shader reads it.
struct Copy {
  std::array<float, 4> orientation{0, 0, 0, 1};
  Vec3 position;        // relative to the eye
  float is_ground = 0;  // 1: with a grid on what faces up
  Vec3 colour;
  float glow = 0;  // 0 to 1: an outline of light, for the own body
  float own = 0;   // 0 to 1: share of the mesh's own colours
};

// The way in which all copies of a mesh look.
struct Coat {
  bool both_sides = false;                  // it is seen from within as well
  std::shared_ptr<const Paint> paint = {};  // multiplied with its own colours; null: nothing is
};

struct Picture {
  std::array<double, 3> eye{};
  Vec3 direction{0, 0, -1};
  Vec3 focus;                                       // relative to the eye; shadows are sharp around it
  float far_m = 400;                                // there all is sky
  std::map<std::size_t, std::vector<Copy>> copies;  // by mesh
};

class Renderer {
 public:
  // Without shadows a picture costs half as much.
  Renderer(Gl& gl, bool shadows);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // The driver's complaints about the shaders; empty if they are well.
  const std::string& error() const { return error_; }
  // A paint that several meshes share is kept once.
  std::size_t Add(const Mesh& mesh, const Coat& coat = {});
  // Its number may be given out again.
  void Remove(std::size_t mesh);
  void Clear();
  void Draw(const Picture& picture, int width, int height);

 private:
  struct Buffers {
    GLuint array = 0, vertices = 0, indices = 0, copies = 0;
    GLsizei index_count = 0;
    bool both_sides = false;
    GLuint paint = 0;  // 0: none
  };
  GLuint Link(const char* vertex, const char* fragment);
  void MakeShadowMap();
  void Free(const Buffers& mesh);
  GLuint PaintOf(const std::shared_ptr<const Paint>& paint);
  void DrawCopies(bool in_colour);
  void SetMatrix(GLuint program, const char* name, const Matrix& matrix);

  Gl& gl_;
  bool shadows_;
  std::string error_;
  GLuint world_ = 0, shadow_ = 0, sky_ = 0, shadow_map_ = 0, shadow_frame_ = 0, nothing_ = 0;
  std::vector<Buffers> meshes_;
  std::vector<std::size_t> removed_;  // numbers that are free
  std::map<std::shared_ptr<const Paint>, GLuint> paints_;
  std::vector<std::pair<std::size_t, GLsizei>> drawn_;  // drawn in the frame under way: mesh, copies
};

}  // namespace desktop
