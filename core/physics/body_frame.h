// BodyFrame: the frame in which collision and solving see a body.
//
// Its origin is the centre of mass and its axes are the principal ones. A static body keeps the frame of its scene
// shape, except that a height field is centred between its lowest and its highest sample: coordinates stay small.
#pragma once

#include "core/world/math.h"

namespace tessera::physics {

struct BodyFrame {
  Vec3d origin;  // in the coordinates of the scene shape, m
  Quatd axes;    // turns a vector of this frame to the coordinates of the scene shape

  friend bool operator==(const BodyFrame&, const BodyFrame&) = default;
  bool turned() const { return !(axes == Quatd()); }
  // From the coordinates of the scene shape into this frame.
  Vec3d FromShape(Vec3d point) const { return Rotate(Conjugate(axes), point - origin); }
  Pose FromShape(const Pose& pose) const {
    return {FromShape(pose.position), Conjugate(axes) * Normalized(pose.orientation)};
  }
};

}  // namespace tessera::physics
