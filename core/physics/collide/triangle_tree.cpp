#include "core/physics/collide/triangle_tree.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>

#include "core/physics/bullet_math.h"

namespace tessera::physics {
namespace {

btIndexedMesh IndexedMesh(const TriangleMeshShape& mesh) {
  btIndexedMesh part;
  part.m_numTriangles = static_cast<int>(mesh.triangles.size());
  part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(mesh.triangles.data());
  part.m_triangleIndexStride = sizeof(mesh.triangles[0]);
  part.m_numVertices = static_cast<int>(mesh.vertices.size());
  part.m_vertexBase = reinterpret_cast<const unsigned char*>(mesh.vertices.data());
  part.m_vertexStride = sizeof(mesh.vertices[0]);
  return part;
}

class AppendTriangle : public btNodeOverlapCallback {
 public:
  AppendTriangle(std::vector<std::uint32_t>* found, std::size_t most) : found_(found), most_(most) {}
  void processNode(int, int triangle) override {
    if (found_->size() <= most_) found_->push_back(static_cast<std::uint32_t>(triangle));
  }

 private:
  std::vector<std::uint32_t>* found_;
  std::size_t most_;
};

}  // namespace

// Bullet keeps pointers into the mesh.
struct TriangleTree::Impl {
  explicit Impl(const TriangleMeshShape& mesh_in) : mesh(mesh_in) {
    arrays.addIndexedMesh(IndexedMesh(mesh), PHY_INTEGER);
    shape = std::make_unique<btBvhTriangleMeshShape>(&arrays, true);
    shape->setMargin(0);  // a margin would lift everything that lies on the mesh
  }

  const TriangleMeshShape mesh;
  btTriangleIndexVertexArray arrays;
  std::unique_ptr<btBvhTriangleMeshShape> shape;
};

TriangleTree::TriangleTree(const TriangleMeshShape& mesh) : impl_(std::make_unique<Impl>(mesh)) {}
TriangleTree::~TriangleTree() = default;

void TriangleTree::TrianglesIn(const Aabb& box, std::vector<std::uint32_t>* found, std::size_t most) const {
  AppendTriangle append(found, most);
  impl_->shape->getOptimizedBvh()->reportAabbOverlappingNodex(&append, ToBullet(box.min), ToBullet(box.max));
}

}  // namespace tessera::physics
