/* A car on four springs, as a movement (tessera/movement.h): the game module has it, and so does a client, which shows
 * its own car ahead of the server by it.
 *
 * Each wheel is a sphere that is swept down from the body to the ground. Where it meets it, a spring and a damper press
 * the body up, the engine pushes it along the wheel, and the tyre holds it across, no harder than it is pressed down.
 * `move` is the wheel and the pedals: right, and forward or back. Button 0 is the brake.
 *
 * Sines come from a series rather than from the mathematics library, whose last bit may differ between machines.
 *
 * Thread rule: a pure function. */
#ifndef TESSERA_EXAMPLES_CAR_MOVEMENT_H
#define TESSERA_EXAMPLES_CAR_MOVEMENT_H

#include <math.h>
#include <string.h>

#include "tessera/movement.h"

/* NOLINTBEGIN(readability-identifier-naming): the names are C's */
#define CAR_WHEELS 4

/* The car remembers how far its springs were pressed in, for the dampers, and where its wheels point. */
typedef struct car_state {
  float pressed[CAR_WHEELS]; /* m */
  float steered;             /* rad, to the left */
} car_state;

static const double car_track = 0.8, car_base = 1.3, car_mount = -0.1; /* where the springs begin, m */
static const double car_travel = 0.5, car_radius = 0.3;                /* a spring's and a wheel's, m */
static const double car_stiffness = 24000, car_damping = 2800;         /* a spring's, N/m and N s/m */
static const double car_power = 7200, car_brakes = 9000;               /* all wheels together, N */
static const double car_grip = 0.9, car_low = 0.2; /* a tyre holds so much of its load; it pulls so low, m */
static const double car_most_steered = 0.5, car_steering_speed = 2.5; /* rad and rad/s */
static const double car_drag = 0.6;                                   /* N s^2/m^2 */

static double car_dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static void car_cross(const double a[3], const double b[3], double out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}
static double car_within(double value, double least, double most) {
  return value < least ? least : value > most ? most : value;
}

/* From the body's axes to the world's: v + 2 w (q x v) + 2 q x (q x v). */
static void car_turn(const double q[4], const double v[3], double out[3]) {
  double once[3], twice[3];
  int i;
  car_cross(q, v, once);
  car_cross(q, once, twice);
  for (i = 0; i < 3; ++i) out[i] = v[i] + 2 * (q[3] * once[i] + twice[i]);
}

/* Adds a force that acts at a point of the body. */
static void car_push_at(const tessera_movement_tick* tick, const double point[3], const double force[3],
                        tessera_movement_push* push) {
  double arm[3], torque[3];
  int i;
  for (i = 0; i < 3; ++i) arm[i] = point[i] - tick->position[i];
  car_cross(arm, force, torque);
  for (i = 0; i < 3; ++i) push->force[i] += force[i], push->torque[i] += torque[i];
}

/* Along the way of a wheel and across it, in the plane that it stands on. */
typedef struct car_tyre {
  double up[3], along[3], across[3];
} car_tyre;

static int car_tyre_on(const double normal[3], const double heading[3], car_tyre* tyre) {
  const double out = car_dot(heading, normal);
  double length;
  int i;
  for (i = 0; i < 3; ++i) tyre->up[i] = normal[i], tyre->along[i] = heading[i] - normal[i] * out;
  length = sqrt(car_dot(tyre->along, tyre->along));
  if (length < 1e-6) return 0;
  for (i = 0; i < 3; ++i) tyre->along[i] /= length;
  car_cross(tyre->along, normal, tyre->across);
  return 1;
}

/* The road acts on the tyre: it drives, brakes and holds it, as far as it grips. */
static void car_roll(const tessera_movement_tick* tick, const double point[3], const tessera_movement_hit* hit,
                     const car_tyre* tyre, double pressed_n, tessera_movement_push* push) {
  double arm[3], slip[3], force[3], at[3], ahead, aside, length, high;
  /* The force that would end the slip of a quarter of the car within two ticks. */
  const double stop = tick->mass_kg / CAR_WHEELS / (2 * tick->seconds);
  int i;
  for (i = 0; i < 3; ++i) arm[i] = point[i] - tick->position[i];
  car_cross(tick->angular_velocity, arm, slip);
  for (i = 0; i < 3; ++i) slip[i] += tick->linear_velocity[i] - hit->velocity[i];
  aside = -car_dot(slip, tyre->across) * stop;
  ahead = (double)tick->move[1] * car_power / CAR_WHEELS;
  if ((tick->buttons & 1) != 0 || tick->move[1] == 0) {
    const double most = ((tick->buttons & 1) != 0 ? car_brakes : car_brakes / 10) / CAR_WHEELS;
    ahead = car_within(-car_dot(slip, tyre->along) * stop, -most, most);
  }
  length = sqrt(ahead * ahead + aside * aside);
  if (length > car_grip * pressed_n) ahead *= car_grip * pressed_n / length, aside *= car_grip * pressed_n / length;
  /* It pulls a little below the body's middle, not at the foot, like a car whose weight lies low: it does not roll. */
  high = -car_dot(arm, tyre->up) - car_low;
  for (i = 0; i < 3; ++i) {
    force[i] = tyre->along[i] * ahead + tyre->across[i] * aside;
    at[i] = point[i] + tyre->up[i] * high;
  }
  car_push_at(tick, at, force, push);
}

/* One wheel; -1 if the engine refused to look. */
static int car_wheel(const tessera_movement_tick* tick, int wheel, car_state* state, tessera_movement_push* push) {
  const double mount[3] = {wheel % 2 == 0 ? -car_track : car_track, car_mount, wheel < 2 ? -car_base : car_base};
  const double up_of_body[3] = {0, 1, 0};
  const double angle = wheel < 2 ? (double)state->steered : 0;
  const double sine = angle - angle * angle * angle / 6 + angle * angle * angle * angle * angle / 120;
  const double heading_of_body[3] = {-sine, 0, -sqrt(1 - sine * sine)};
  double up[3], heading[3], from[3], to[3], foot[3], force[3], pressed, spring;
  tessera_movement_hit hit = TESSERA_MOVEMENT_HIT;
  car_tyre tyre;
  int i, met;
  car_turn(tick->orientation, mount, from);
  car_turn(tick->orientation, up_of_body, up);
  car_turn(tick->orientation, heading_of_body, heading);
  for (i = 0; i < 3; ++i) from[i] += tick->position[i], to[i] = from[i] - up[i] * car_travel;
  met = tick->sweep(tick->call, from, to, car_radius, &hit);
  if (met < 0) return -1;
  pressed = met == 0 ? 0 : car_travel * (1 - hit.fraction);
  spring = car_stiffness * pressed + car_damping * (pressed - (double)state->pressed[wheel]) / tick->seconds;
  state->pressed[wheel] = (float)pressed;
  if (met == 0 || spring <= 0) return 0;
  for (i = 0; i < 3; ++i) foot[i] = hit.center[i] - hit.normal[i] * car_radius, force[i] = up[i] * spring;
  car_push_at(tick, from, force, push);
  if (car_tyre_on(hit.normal, heading, &tyre)) car_roll(tick, foot, &hit, &tyre, spring, push);
  return 0;
}

static int car_move(const tessera_movement_tick* tick, void* memory, tessera_movement_push* push) {
  const double speed = sqrt(car_dot(tick->linear_velocity, tick->linear_velocity));
  const double turn = car_steering_speed * tick->seconds;
  double wanted, steered;
  car_state state;
  int i;
  memcpy(&state, memory, sizeof state);
  wanted = -(double)tick->move[0] * car_most_steered / (1 + speed / 15);
  steered = (double)state.steered;
  state.steered = (float)(steered + car_within(wanted - steered, -turn, turn));
  for (i = 0; i < CAR_WHEELS; ++i) {
    if (car_wheel(tick, i, &state, push) != 0) return 1;
  }
  for (i = 0; i < 3; ++i) push->force[i] -= car_drag * speed * tick->linear_velocity[i];
  memcpy(memory, &state, sizeof state);
  return 0;
}

/* It moves the bodies to which the scene gives the kind "car". */
static const tessera_movement car_movement = {
    sizeof car_movement, TESSERA_MOVEMENT_ABI, "car", 1, sizeof(car_state), "car", car_move, NULL};

/* NOLINTEND(readability-identifier-naming) */

#endif
