// Constants of the physics outside the solver (whose own are in solve/tuning.h), each with its unit, its reason, and
// the harm if it changes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::physics {

// A pair touches when it is at most this far apart, and has parted when it is further than that. The gap between the
// two keeps a resting body, which breathes by a fraction of a millimetre, from touching and parting again and again.
inline constexpr float kTouchBegin_m = 0.0f, kTouchEnd_m = 0.005f;

// An island whose bodies are slower than both for kSleepAfter_s falls asleep. Bullet's own .8 m/s and 1 rad/s stop
// bodies that visibly move.
inline constexpr float kSleepLinear_m_s = 0.05f, kSleepAngular_rad_s = 0.1f;

// How far a sleeper may be moved from where it fell asleep, m and rad, by states that are slow enough to sleep with.
// Larger lets a creeping neighbour sink into a sleeper; 0 lets two regions wake each other for ever.
inline constexpr double kCreep_m = 0.002;
inline constexpr float kCreep_rad = 0.01f;

// Products of inertia below this share of the trace are rounding, and the shape's own axes are the principal ones.
inline constexpr double kSymmetryTolerance = 1e-6;

// --- The step -----------------------------------------------------------------------------------------------------

// Surfaces nearer than this are watched for contact even while they move apart, m. Smaller, and a resting point that
// trembles comes and goes; larger, and more pairs are solved that never touch.
inline constexpr float kSpeculative_m = 0.02f;

// A pair whose points may come this near to each other in the step, m, is solved; otherwise its bodies fly free.
inline constexpr float kTouchSoon_m = 0.001f;

// A pair that moves against each other by more than this share of the smaller one's inner radius in a step is swept:
// its nearest points of now say nothing about where it will meet. Larger, and a corner that passes by is felt; smaller,
// and slow bodies pay for sweeps.
inline constexpr float kFastShare = 0.25f;

// A body that ends this far from its predicted motion, m, was deflected.
inline constexpr float kDeflected_m = 1e-4f;

// A body that was solved and yet reaches through a contact by this share of its inner radius at the end of a step has
// turned through it, and is swept.
inline constexpr float kThroughShare = 0.5f;

// A sweep ends this far before the surfaces meet, m: the resolution of floats across a large shape.
inline constexpr float kImpactDistance_m = 0.0005f;

// A sweep that stops a light body against one of at least this many times its mass lets the heavy one continue, and the
// light one goes along. Smaller, and equals push each other on into bodies beyond; larger, and bodies that stand in a
// vehicle sink into it when something bounces there.
inline constexpr double kCarrierMass = 8;

// The trees hold bounds that are wider by this, m, and hear of a body only when it leaves them. Larger spares them work
// and finds more pairs that are apart.
inline constexpr float kBoundsMargin_m = 0.05f;
// Those bounds reach ahead of a moving body by so many steps' motion, and by no more than this, m: the trees hear of a
// flying body in every fourth step.
inline constexpr float kBoundsAhead = 3;
inline constexpr float kMostAhead_m = 0.5f;
inline constexpr float kEverywhere_m = 1e9f;  // half the width of a shape without bounds

// An island that weighs less than this many times its lightest body carries no load worth computing: the fewest
// substeps hold it.
inline constexpr double kLightIsland = 6;

// A body that stands on one body alone can lean, and counts for this many times its weight. At 1 a tower of 20 falls
// within a minute, and one of 40 sways.
inline constexpr double kColumnLoad = 2;

// An island's load counts as a mean over so many steps. Fewer, and a pile that falls together gets now 4, now 8
// substeps, and runs that differ by a hair spread by it; two parts of one pile, solved apart, find other loads in
// single steps and fall apart. More, and a loaded island needs as many steps longer to be held.
inline constexpr float kLoadSteps = 10;
inline constexpr float kMostIslandLoad = 1e6f;  // cap of a load; far less gets as many substeps as there are
inline constexpr float kUnknownLoad = -1;       // load of a body that nothing held: the next one counts at once

// An island of this load has its contacts solved together (solve/direct_solve.h): 1000 unit cubes upon one, or 200 of
// .2 m, which is what 64 substeps hold on 5 to 20 of them. Lower, and loads that come down on what substeps would have
// held rock on it; higher, and what lies between is held by neither.
inline constexpr float kDirectLoad = 2000;
// Only while nothing in it approaches faster than this, m/s. Without that bound a load of 3000 that comes down by .1 m
// throws boxes out at 200 m/s; lower, and what settles is solved now one way, now the other.
inline constexpr float kCalm_m_s = 0.25f;
// In such an island of more contacts than kMostBearing those of this load are solved together.
inline constexpr float kBearsToo = 20;
// Most contacts of an island that are solved together, which bounds what a factorisation costs: some .3 ms. An island
// with more gets as many substeps as there are, which hold some 1000 to 1.
inline constexpr int kMostBearing = 64;
// Fewest substeps of an island with contacts that are solved together, and their cost in contacts that are relaxed.
inline constexpr int kDirectSubsteps = 4, kDirectWork = 64;

// Inner radius of bodies with no solid middle, or hardly one, where loads are scaled by size, m.
inline constexpr double kLeastInner_m = 0.005;

// Jointed bodies of one island count for at most this many masses of the lightest: chains longer than that are seldom
// straight. 64 give them 8 substeps; with 2 a swinging chain of 33 equal bodies opens by .3 m.
inline constexpr float kMostPull = 64;

// The budget of a step for solving, in contacts times substeps (see solve/substeps.h): some 10 ms of one core. Above
// it, the most expensive islands get fewer substeps than they need, and give way sooner than the tick does.
inline constexpr std::int64_t kWorkBudget = 250'000;

// All bodies of an island must have been slow for this long before it sleeps, s. Shorter, and a ball at the top of its
// flight hangs there; longer costs work.
inline constexpr float kSleepAfter_s = 0.5f;

// --- Contact search (collide/).

// How much better, m, another face must be before a pair gives up the one its last contact lay on, and its share of the
// smaller box or hull. Smaller lets rounding swap the faces of a resting pair, and its impulses with them; larger shows
// as depth along the wrong face.
inline constexpr float kKeepFace_m = 0.0005f, kKeepFaceShare = 0.01f;
// How much better an edge against an edge must be than the best face. A face holds up to four points where edges hold
// one, so in doubt the face; larger makes crossed edges rest on a face that is deeper than need be.
inline constexpr float kEdgeLead_m = 0.001f, kEdgeLeadShare = 0.02f;
// Two boxes that overlap, or are apart, by less than this athwart of where they would touch graze each other, rim by
// rim, and do not touch; and its share of the smaller half extent. Must be more than what rests sinks in, or boxes
// stumble over the seams of a floor of boxes; what bears on a narrower ledge falls off it.
inline constexpr float kGraze_m = 0.005f, kGrazeShare = 0.03f;
// A point beyond the edge of a face by less than this share of the face's half width still lies on the face. Keeps the
// feature keys of flush corners through rounding; a larger value would hold points that have slid off.
inline constexpr float kClipSlack = 1e-4f;
// Most pairs of edges that are looked at one by one; hulls with more go by GJK and EPA, which take a few microseconds
// whatever their size.
inline constexpr std::size_t kEdgePairs = 2500;
// A pair is not searched anew while no point of the smaller body moved further against the other than this since the
// last search, m, nor than this share of its outer radius; nor turned further than this. Points slide along faces
// meanwhile, so the error is of second order: 2 mm times .01 rad, .02 mm; the normal lags by as much as the turn.
inline constexpr float kReuseMove_m = 0.002f, kReuseShare = 0.02f, kReuseTurn_rad = 0.01f;
// A new point takes over the impulse of an old one that lay within this, m, and this share of the smaller outer radius,
// where none has its name.
inline constexpr float kCarry_m = 0.02f, kCarryShare = 0.1f;

}  // namespace tessera::physics
