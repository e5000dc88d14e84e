#include "core/physics/collide/triangle_tree.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <LinearMath/btAabbUtil2.h>

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

// Bullet's own walk writes a static count of its steps, which threads must not share.
void TriangleTree::TrianglesIn(const Aabb& box, std::vector<std::uint32_t>* found, std::size_t most) const {
  btOptimizedBvh& tree = *impl_->shape->getOptimizedBvh();
  unsigned short low[3], high[3];
  tree.quantizeWithClamp(low, ToBullet(box.min), 0);
  tree.quantizeWithClamp(high, ToBullet(box.max), 1);
  const QuantizedNodeArray& nodes = tree.getQuantizedNodeArray();
  for (int i = 0; i < nodes.size() && found->size() <= most;) {
    const btQuantizedBvhNode& node = nodes[i];
    const bool overlaps =
        testQuantizedAabbAgainstQuantizedAabb(low, high, node.m_quantizedAabbMin, node.m_quantizedAabbMax) != 0;
    if (overlaps && node.isLeafNode()) found->push_back(static_cast<std::uint32_t>(node.getTriangleIndex()));
    i += overlaps || node.isLeafNode() ? 1 : node.getEscapeIndex();
  }
}

}  // namespace tessera::physics
