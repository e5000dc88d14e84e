// Scenes that a border cuts: what meets, rests, hangs and drives across x = 0, and across z = 0 where four regions
// meet.
//
// `Cut` gives a scene the bounds that put the borders of a grid there. Bodies of `Jittered` scenes keep their places
// but for a little, and change their ids: the order in which a solver comes to them. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "core/world/partition_map.h"
#include "core/world/scene.h"

namespace tessera::scenes {

// Bounds whose grid of 1, 2, 4 or 9 regions has a border at x = 0, one at z = 0 from 4 on, and cells `cell_m` wide.
void Cut(Scene& scene, std::uint32_t regions, double cell_m);
// The grid map of a scene that was cut so, or `regions` strips along x of `cell_m` each, the middle of all at x = 0.
PartitionMap GridOf(const Scene& scene, std::uint32_t regions);
PartitionMap StripsOf(Scene& scene, std::uint32_t regions, double cell_m);

// Every dynamic body that no joint holds is moved sideways by up to `jitter_m`, and the ids of all are dealt anew.
// `id_of[i]` is the id of what was the i-th body. Seed 0 changes nothing.
struct Jitter {
  Scene scene;
  std::vector<BodyId> id_of;
};
Jitter Jittered(const Scene& scene, std::uint64_t seed, double jitter_m);

// Two bodies of 1 and `mass_ratio` kg that meet at x = 0, head on or, `oblique`, past each other's middle; restitution
// .7, no gravity. Bodies 1 and 2.
Scene CollidingPair(ShapePtr shape_a, ShapePtr shape_b, double mass_ratio, bool oblique);
// Six balls (r .5, 1 kg) about x = 0, `gap_m` apart; the first comes at 5 m/s, 1 m away. No friction, no gravity.
Scene BallRow(double restitution, double gap_m);
// Two blocks of 4 x 4 x 4 balls that fly into each other at x = 0; no gravity.
Scene CollidingBlocks();
// A tower whose cubes stand a micrometre to this side and that of x = 0 in turn, or, `corner`, of x = z = 0: with
// owners pinned, each belongs to another region than the one below.
Scene TowerInTurn(int n, bool corner);
// A wall along x of `rows` courses of bricks of 2 x 1 x 1 m, a quarter brick off each other, its middle at x = 0; along
// the border if `along`, its bricks to this side and that of x = 0 in turn.
Scene BrickWall(int rows, int columns, bool along);
// A bridge of planks on hinges from x = -5 to 5, 3 m up, its ends jointed to the world, on which twelve balls fall.
Scene Bridge();
// Bodies of four shapes in a closed box of 12 x 12 m, which rain down and come to lie; restitution .3. Bodies 1 to 5
// are floor and walls.
Scene RainInBox(int count);
// The same shapes fly about in a closed box that floats without gravity, a body itself, wider than a region: nothing
// acts from outside.
Scene FloatingBox(int count);
// `count` tiles along x, the middle of the row at x = 0; the first is pushed over. Tile i is body i + 2.
Scene DominoRow(int count);
// A cart with four driven wheels that goes along x with a crate on its bed, over two sills.
struct Vehicle {
  Scene scene;
  BodyId chassis, crate;
};
Vehicle Drive(double from_x);
// The same work for a region of side `cell_m` in each of `side` x `side` cells, whatever its neighbours do: four flat
// pyramids in its middle; and eight balls that roll out of it and bounce off the world's edge.
Scene EqualCells(int side, double cell_m);

}  // namespace tessera::scenes
