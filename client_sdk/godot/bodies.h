// Bodies: draws the bodies of a world, as a Node3D each or as one MultiMesh for each shape.
//
// A Node3D is named body_ID and has a MeshInstance3D for each part of the shape; a game may add its own, hide these, or
// free it. Static bodies of the scene and of tiles that are here are
// nodes in both ways. Meshes have no material, so the engine's default one
// draws them.
//
// Thread rule: as engine.h.
#pragma once

#include <tessera/tessera.h>

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "engine.h"

namespace godot_plugin {

enum class Drawing : std::int64_t { kNothing = 0, kNodes = 1, kMultiMesh = 2 };

class Bodies {
 public:
  struct Changes {
    std::vector<std::uint64_t> entered, left;
  };

  // Children are added to `parent`, which outlives this.
  explicit Bodies(void* parent) : parent_(parent) {}

  // Counts for bodies that are met from now on.
  void Draw(Drawing drawing) { drawing_ = drawing; }
  Drawing drawing() const { return drawing_; }

  // The scene is here: its static bodies are drawn.
  void TakeScene(const tessera_client* client);
  // A tile of a large level has come, or goes.
  void TakeTile(const tessera_client* client, std::uint32_t tile);
  void DropTile(std::uint32_t tile);
  // Puts each body where it is to be drawn now. Which have come and gone is for the caller to pass on.
  Changes Update(tessera_client* client, std::int64_t now_ns);
  // Null without one: it is not in sight, or is no node.
  void* NodeOf(std::uint64_t id) const;
  // Frees all nodes. Before the client whose shapes they show is closed.
  void Clear();

 private:
  // A part of a shape that is no compound; for MultiMesh, with the instances of all bodies.
  struct Part {
    Value mesh;
    Pose pose;
    Node instances;
    Value multimesh;
    std::size_t room = 0;     // instances of the multimesh
    std::vector<float> rows;  // 12 an instance: filled and sent with each frame
  };
  using Look = std::vector<Part>;
  struct Shown {
    Node node;
    Look* look = nullptr;
    Pose pose;
    std::uint64_t frame = 0;
  };

  using Looks = std::unordered_map<const tessera_shape*, Look>;
  Look* LookOf(const tessera_shape* shape, Looks& looks);
  Look* LookOf(const tessera_shape* shape) { return LookOf(shape, looks_); }
  Value NewNode(std::uint64_t id, const Look& look, const Pose& pose);
  void Enter(const tessera_client* client, std::uint64_t id, const Pose& pose, Shown& shown);
  void Place(const Pose& pose, Shown& shown);
  void SendInstances(Part& part);

  void* parent_;
  Drawing drawing_ = Drawing::kNodes;
  float plane_half_m_ = 100;
  std::uint64_t frame_ = 0;
  Looks looks_;
  std::unordered_map<std::uint64_t, Shown> shown_;
  std::vector<Node> statics_;
  std::unordered_map<std::uint32_t, std::vector<Node>> tiles_;
  std::vector<tessera_body> bodies_;
  Name add_child_{"add_child"}, set_transform_{"set_transform"}, set_buffer_{"set_buffer"};
};

}  // namespace godot_plugin
