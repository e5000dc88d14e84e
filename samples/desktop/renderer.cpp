#include "renderer.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <vector>

namespace desktop {
namespace {

constexpr GLsizei kShadowPixels = 2048, kNoShadowPixels = 16;
constexpr float kShadowHalf_m = 60, kShadowDepth_m = 300;
constexpr Vec3 kToSun = {0.45F, 0.8F, 0.35F};
constexpr float kViewAngle = 1.05F, kNear_m = 0.2F;

constexpr char kPlace[] = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 orientation;
layout(location = 3) in vec4 place;
layout(location = 4) in vec4 colour;
layout(location = 5) in vec3 own_colour;
layout(location = 6) in vec2 own_place;
layout(location = 7) in float own_share;
uniform mat4 view;
uniform mat4 sun_view;
out vec3 at;
out vec3 facing;
out vec3 in_shadow_map;
out vec3 own;
out vec2 place_in_paint;
flat out vec4 paint;
flat out float ground;
flat out float share;
vec3 turned(vec3 v) { return v + 2.0 * cross(orientation.xyz, cross(orientation.xyz, v) + orientation.w * v); }
void main() {
  at = turned(position) + place.xyz;
  facing = turned(normal);
  // From the side that is seen, so that no side casts a shadow on itself.
  vec3 off = dot(facing, at) > 0.0 ? -facing : facing;
  in_shadow_map = (sun_view * vec4(at + 0.05 * off, 1.0)).xyz * 0.5 + 0.5;
  paint = colour;
  ground = place.w;
  own = own_colour;
  place_in_paint = own_place;
  share = own_share;
  gl_Position = view * vec4(at, 1.0);
}
)";

constexpr char kShade[] = R"(#version 330 core
in vec3 at;
in vec3 facing;
in vec3 in_shadow_map;
in vec3 own;
in vec2 place_in_paint;
flat in vec4 paint;
flat in float ground;
flat in float share;
uniform vec3 eye;
uniform vec3 to_sun;
uniform vec3 haze;
uniform vec3 range;
uniform sampler2DShadow shadows;
uniform sampler2D own_paint;
uniform int is_painted;
out vec4 pixel;
float lit() {
  if (any(lessThan(in_shadow_map, vec3(0.0))) || any(greaterThan(in_shadow_map, vec3(1.0)))) return 1.0;
  float sum = 0.0;
  for (int i = 0; i < 4; ++i) {
    vec2 offset = (vec2(i & 1, i >> 1) - 0.5) / 1400.0;
    sum += texture(shadows, vec3(in_shadow_map.xy + offset, in_shadow_map.z - 0.0007));
  }
  return sum / 4.0;
}
// Lines every `step` metres, as wide as a pixel or two wherever they are, fading where they would flicker.
float grid(vec2 p, float step) {
  vec2 width = fwidth(p / step);
  vec2 distance = abs(fract(p / step - 0.5) - 0.5) / max(width, vec2(1e-5));
  return (1.0 - min(min(distance.x, distance.y), 1.0)) * clamp(1.0 - 4.0 * max(width.x, width.y), 0.0, 1.0);
}
// Files have colours as light, and a screen wants them as eyes tell them apart (IEC 61966-2-1).
vec3 for_screen(vec3 light) {
  return mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light));
}
void main() {
  vec3 n = normalize(facing);
  if (!gl_FrontFacing) n = -n;
  vec3 to_eye = normalize(-at);
  vec3 light_of_own = is_painted != 0 ? own * texture(own_paint, place_in_paint).rgb : own;
  vec3 base = mix(paint.rgb, for_screen(light_of_own), share);
  if (ground > 0.5 && n.y > 0.7) {
    vec2 p = at.xz + eye.xz;
    base *= 1.0 + 0.10 * grid(p, 2.0);
    base = mix(base, base * 1.45, grid(p, 10.0));
  }
  float sun = max(dot(n, to_sun), 0.0) * lit();
  vec3 sky_light = mix(vec3(0.36, 0.35, 0.34), vec3(0.46, 0.51, 0.60), n.y * 0.5 + 0.5);
  vec3 light = sky_light + sun * vec3(0.82, 0.76, 0.64);
  vec3 colour = base * light;
  colour += (1.0 - ground) * sun * 0.20 * pow(max(dot(n, normalize(to_sun + to_eye)), 0.0), 40.0);
  colour += paint.a * pow(1.0 - max(dot(n, to_eye), 0.0), 2.0) * vec3(1.0, 0.95, 0.7);
  float away = length(at);
  float fog = smoothstep(range.x, range.y, away);
  pixel = vec4(mix(colour, haze, fog), 1.0);
}
)";

constexpr char kShadowShade[] = "#version 330 core\nvoid main() {}\n";

constexpr char kSkyPlace[] = R"(#version 330 core
out float height;
uniform vec3 range;
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  height = corner.y * range.y + range.x;
  gl_Position = vec4(corner, 1.0, 1.0);
}
)";

constexpr char kSkyShade[] = R"(#version 330 core
in float height;
uniform vec3 haze;
out vec4 pixel;
void main() { pixel = vec4(mix(haze, vec3(0.28, 0.45, 0.70), smoothstep(0.0, 0.8, height)), 1.0); }
)";

constexpr Vec3 kHaze = {0.72F, 0.79F, 0.86F};

}  // namespace

Renderer::Renderer(Gl& gl, bool shadows) : gl_(gl), shadows_(shadows) {
  world_ = Link(kPlace, kShade);
  shadow_ = Link(kPlace, kShadowShade);
  sky_ = Link(kSkyPlace, kSkyShade);
  gl_.GenVertexArrays(1, &nothing_);
  MakeShadowMap();
}

Renderer::~Renderer() { Clear(); }

GLuint Renderer::Link(const char* vertex, const char* fragment) {
  const GLuint program = gl_.CreateProgram();
  for (const auto& [kind, text] : {std::pair(GL_VERTEX_SHADER, vertex), std::pair(GL_FRAGMENT_SHADER, fragment)}) {
    const GLuint shader = gl_.CreateShader(static_cast<GLenum>(kind));
    gl_.ShaderSource(shader, 1, &text, nullptr);
    gl_.CompileShader(shader);
    gl_.AttachShader(program, shader);
    gl_.DeleteShader(shader);
  }
  gl_.LinkProgram(program);
  GLint linked = GL_FALSE;
  gl_.GetProgramiv(program, GL_LINK_STATUS, &linked);
  if (linked == GL_FALSE) {
    char text[512] = "";
    gl_.GetProgramInfoLog(program, sizeof text, nullptr, text);
    error_ += text;
  }
  return program;
}

void Renderer::MakeShadowMap() {
  const GLsizei shadow_pixels = shadows_ ? kShadowPixels : kNoShadowPixels;
  glGenTextures(1, &shadow_map_);
  glBindTexture(GL_TEXTURE_2D, shadow_map_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, shadow_pixels, shadow_pixels, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
               nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  gl_.GenFramebuffers(1, &shadow_frame_);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, shadow_frame_);
  gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, shadow_map_, 0);
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
}

// Smaller copies of it are drawn from further away, and its edges join: it may be laid side by side.
GLuint Renderer::PaintOf(const std::shared_ptr<const Paint>& paint) {
  if (paint == nullptr) return 0;
  const auto [found, is_new] = paints_.try_emplace(paint, 0);
  if (!is_new) return found->second;
  glGenTextures(1, &found->second);
  glBindTexture(GL_TEXTURE_2D, found->second);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8, paint->width, paint->height, 0, GL_RGB, GL_UNSIGNED_BYTE, paint->rgb.data());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  gl_.GenerateMipmap(GL_TEXTURE_2D);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  return found->second;
}

std::size_t Renderer::Add(const Mesh& mesh, const Coat& coat) {
  // Corners that triangles share are computed once.
  std::map<std::array<float, 11>, GLuint> known;
  std::vector<Vertex> corners;
  std::vector<GLuint> indices;
  for (const Vertex& v : mesh) {
    const std::array<float, 11> key = {v.position.x, v.position.y, v.position.z, v.normal.x, v.normal.y, v.normal.z,
                                       v.colour.x,   v.colour.y,   v.colour.z,   v.place[0], v.place[1]};
    const auto [found, is_new] = known.try_emplace(key, static_cast<GLuint>(corners.size()));
    if (is_new) corners.push_back(v);
    indices.push_back(found->second);
  }
  Buffers buffers;
  buffers.index_count = static_cast<GLsizei>(indices.size());
  buffers.both_sides = coat.both_sides;
  buffers.paint = PaintOf(coat.paint);
  gl_.GenVertexArrays(1, &buffers.array);
  gl_.BindVertexArray(buffers.array);
  const auto attribute = [&](GLuint location, GLint numbers, std::size_t stride, std::size_t offset, GLuint divisor) {
    gl_.EnableVertexAttribArray(location);
    gl_.VertexAttribPointer(location, numbers, GL_FLOAT, GL_FALSE, static_cast<GLsizei>(stride),
                            reinterpret_cast<const void*>(offset));
    gl_.VertexAttribDivisor(location, divisor);
  };
  gl_.GenBuffers(1, &buffers.vertices);
  gl_.BindBuffer(GL_ARRAY_BUFFER, buffers.vertices);
  gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(corners.size() * sizeof(Vertex)), corners.data(),
                 GL_STATIC_DRAW);
  gl_.GenBuffers(1, &buffers.indices);
  gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers.indices);
  gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(GLuint)), indices.data(),
                 GL_STATIC_DRAW);
  attribute(0, 3, sizeof(Vertex), offsetof(Vertex, position), 0);
  attribute(1, 3, sizeof(Vertex), offsetof(Vertex, normal), 0);
  attribute(5, 3, sizeof(Vertex), offsetof(Vertex, colour), 0);
  attribute(6, 2, sizeof(Vertex), offsetof(Vertex, place), 0);
  gl_.GenBuffers(1, &buffers.copies);
  gl_.BindBuffer(GL_ARRAY_BUFFER, buffers.copies);
  attribute(2, 4, sizeof(Copy), offsetof(Copy, orientation), 1);
  attribute(3, 4, sizeof(Copy), offsetof(Copy, position), 1);
  attribute(4, 4, sizeof(Copy), offsetof(Copy, colour), 1);
  attribute(7, 1, sizeof(Copy), offsetof(Copy, own), 1);
  gl_.BindVertexArray(0);
  if (removed_.empty()) {
    meshes_.push_back(buffers);
    return meshes_.size() - 1;
  }
  const std::size_t number = removed_.back();
  removed_.pop_back();
  meshes_[number] = buffers;
  return number;
}

void Renderer::Free(const Buffers& mesh) {
  gl_.DeleteVertexArrays(1, &mesh.array);
  gl_.DeleteBuffers(1, &mesh.vertices);
  gl_.DeleteBuffers(1, &mesh.indices);
  gl_.DeleteBuffers(1, &mesh.copies);
}

void Renderer::Remove(std::size_t mesh) {
  Free(meshes_[mesh]);
  meshes_[mesh] = {};
  removed_.push_back(mesh);
}

// Those that were removed have the name 0, which OpenGL passes over.
void Renderer::Clear() {
  for (const Buffers& mesh : meshes_) Free(mesh);
  meshes_.clear();
  removed_.clear();
  for (const auto& [paint, texture] : paints_) glDeleteTextures(1, &texture);
  paints_.clear();
}

void Renderer::SetMatrix(GLuint program, const char* name, const Matrix& matrix) {
  gl_.UniformMatrix4fv(gl_.GetUniformLocation(program, name), 1, GL_FALSE, matrix.data());
}

void Renderer::DrawCopies(bool in_colour) {
  const GLint is_painted = gl_.GetUniformLocation(world_, "is_painted");
  for (const auto& [mesh, count] : drawn_) {
    if (meshes_[mesh].both_sides) {
      glDisable(GL_CULL_FACE);
    } else {
      glEnable(GL_CULL_FACE);
    }
    if (in_colour) {
      glBindTexture(GL_TEXTURE_2D, meshes_[mesh].paint);
      gl_.Uniform1i(is_painted, meshes_[mesh].paint != 0 ? 1 : 0);
    }
    gl_.BindVertexArray(meshes_[mesh].array);
    gl_.DrawElementsInstanced(GL_TRIANGLES, meshes_[mesh].index_count, GL_UNSIGNED_INT, nullptr, count);
  }
}

void Renderer::Draw(const Picture& picture, int width, int height) {
  drawn_.clear();
  for (const auto& [mesh, copies] : picture.copies) {
    if (mesh >= meshes_.size() || copies.empty()) continue;
    gl_.BindBuffer(GL_ARRAY_BUFFER, meshes_[mesh].copies);
    gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(copies.size() * sizeof(Copy)), copies.data(),
                   GL_STREAM_DRAW);
    drawn_.emplace_back(mesh, static_cast<GLsizei>(copies.size()));
  }
  const Vec3 sun = Unit(kToSun);
  const Matrix sun_view =
      Orthographic(kShadowHalf_m, 0, kShadowDepth_m) * LookAt(picture.focus + sun * (kShadowDepth_m / 2), sun * -1);
  const Matrix view = Perspective(kViewAngle, static_cast<float>(width) / static_cast<float>(std::max(height, 1)),
                                  kNear_m, picture.far_m) *
                      LookAt({}, picture.direction);

  glEnable(GL_DEPTH_TEST);
  glEnable(GL_CULL_FACE);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, shadow_frame_);
  const GLsizei shadow_pixels = shadows_ ? kShadowPixels : kNoShadowPixels;
  glViewport(0, 0, shadow_pixels, shadow_pixels);
  glClear(GL_DEPTH_BUFFER_BIT);  // where shadows are off, nothing is between the sun and anything
  gl_.UseProgram(shadow_);
  SetMatrix(shadow_, "view", sun_view);
  SetMatrix(shadow_, "sun_view", sun_view);
  if (shadows_) DrawCopies(false);

  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, width, height);
  glClear(GL_DEPTH_BUFFER_BIT | GL_COLOR_BUFFER_BIT);
  const auto vector = [&](GLuint program, const char* name, Vec3 v) {
    gl_.Uniform3f(gl_.GetUniformLocation(program, name), v.x, v.y, v.z);
  };
  glDisable(GL_DEPTH_TEST);
  gl_.UseProgram(sky_);
  vector(sky_, "haze", kHaze);
  vector(sky_, "range", {picture.direction.y, std::tan(kViewAngle / 2), 0});
  gl_.BindVertexArray(nothing_);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glEnable(GL_DEPTH_TEST);

  gl_.UseProgram(world_);
  SetMatrix(world_, "view", view);
  SetMatrix(world_, "sun_view", sun_view);
  vector(world_, "to_sun", sun);
  vector(world_, "haze", kHaze);
  vector(world_, "range", {0.35F * picture.far_m, 0.95F * picture.far_m, 0});
  vector(world_, "eye",
         {static_cast<float>(picture.eye[0]), static_cast<float>(picture.eye[1]), static_cast<float>(picture.eye[2])});
  gl_.ActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, shadow_map_);
  gl_.Uniform1i(gl_.GetUniformLocation(world_, "shadows"), 0);
  gl_.Uniform1i(gl_.GetUniformLocation(world_, "own_paint"), 1);
  gl_.ActiveTexture(GL_TEXTURE1);
  DrawCopies(true);
  glBindTexture(GL_TEXTURE_2D, 0);
  gl_.ActiveTexture(GL_TEXTURE0);
  gl_.BindVertexArray(0);
  gl_.UseProgram(0);
}

}  // namespace desktop
