// Motion: where the bodies are between the frames. It belongs to the worker.
//
// `current` is the pose that the newest frame has, `previous` where the body was shown when that came, and `shown` lies
// between the two.

import { Bodies, POSE_PARTS, SPEED, TURN, grown } from '../world/bodies.ts';
import { type Frame, Changed, UNITS_PER_METRE, idText } from '../protocol/messages.ts';
import { unpackOrientation } from '../protocol/orientation.ts';
import { ProtocolError } from '../protocol/reader.ts';
import type { FrameTold } from './messages.ts';

export class Motion {
  // It has the slots that the page's own has.
  readonly bodies = new Bodies({ appeared: (slot) => this.begin(slot), vanished: (slot) => this.end(slot), ownerChanged: () => {} });
  previous = new Float32Array(0);
  current = new Float32Array(0);
  shown = new Float32Array(0);
  moving_count = 0;

  private moving = new Int32Array(0); // slots whose pose is on its way
  private is_moving = new Uint8Array(0); // by slot
  private is_new = new Uint8Array(0); // by slot: it has had no pose
  private units = new Float64Array(0); // current position as the wire has it

  clear(): void {
    this.moving_count = 0;
    this.is_moving.fill(0);
    this.bodies.clear();
  }

  // The frame came when bodies were `fraction` of their way, and go on from there.
  apply(frame: Frame, fraction: number): FrameTold {
    this.interpolate(fraction);
    for (let index = 0; index < this.moving_count; ++index) {
      const p = POSE_PARTS * this.moving[index]!;
      for (let part = p; part < p + POSE_PARTS; ++part) this.previous[part] = this.shown[part]!;
    }
    const { kind, tick, time, paused, limited, vanished, appeared } = frame;
    const told: FrameTold = { kind, tick, time, paused, limited, vanished, appeared, owners: [], states: [] };
    this.bodies.apply(told);
    this.change(frame, told);
    return told;
  }

  // Shows all that moves `fraction` of the way from the previous to the current pose. Says whether anything moved.
  interpolate(fraction: number): boolean {
    const { moving, moving_count, previous, current, shown } = this;
    const rest = 1 - fraction;
    for (let index = 0; index < moving_count; ++index) {
      const p = POSE_PARTS * moving[index]!;
      const t = p + TURN;
      const ax = current[t]!;
      const ay = current[t + 1]!;
      const az = current[t + 2]!;
      const aw = current[t + 3]!;
      const bx = previous[t]!;
      const by = previous[t + 1]!;
      const bz = previous[t + 2]!;
      const bw = previous[t + 3]!;
      // A normalised mean of the two, along the shorter way.
      const back = ax * bx + ay * by + az * bz + aw * bw < 0 ? -rest : rest;
      const x = ax * fraction + bx * back;
      const y = ay * fraction + by * back;
      const z = az * fraction + bz * back;
      const w = aw * fraction + bw * back;
      const scale = 1 / Math.sqrt(x * x + y * y + z * z + w * w);
      shown[p] = previous[p]! * rest + current[p]! * fraction;
      shown[p + 1] = previous[p + 1]! * rest + current[p + 1]! * fraction;
      shown[p + 2] = previous[p + 2]! * rest + current[p + 2]! * fraction;
      shown[t] = x * scale;
      shown[t + 1] = y * scale;
      shown[t + 2] = z * scale;
      shown[t + 3] = w * scale;
    }
    if (fraction === 1) this.arrive();
    return moving_count > 0;
  }

  // Bodies that are where the newest frame has them need no work until they move again.
  private arrive(): void {
    const { moving, current, shown } = this;
    for (let index = 0; index < this.moving_count; ++index) {
      const slot = moving[index]!;
      const p = POSE_PARTS * slot;
      for (let part = p; part < p + POSE_PARTS; ++part) shown[part] = this.previous[part] = current[part]!;
      this.is_moving[slot] = 0;
    }
    this.moving_count = 0;
  }

  // Ids ascend in the frame as in `order`, so one walk along both finds every body.
  private change(frame: Frame, told: FrameTold): void {
    const changed = frame.changed;
    const { order, high, low, count } = this.bodies;
    const { current, units } = this;
    let place = 0;
    for (let index = 0; index < changed.count; ++index) {
      const wanted_high = changed.high[index]!;
      const wanted_low = changed.low[index]!;
      while (place < count) {
        const slot = order[place]!;
        if (high[slot]! > wanted_high || (high[slot] === wanted_high && low[slot]! >= wanted_low)) break;
        ++place;
      }
      const slot = place < count ? order[place]! : -1;
      if (slot < 0 || high[slot] !== wanted_high || low[slot] !== wanted_low) {
        throw new ProtocolError(`a frame changes body ${idText(wanted_high, wanted_low)}, which has not appeared`);
      }
      const mask = changed.mask[index]!;
      if (mask & Changed.position) {
        for (let axis = 0; axis < 3; ++axis) {
          units[3 * slot + axis] = units[3 * slot + axis]! + changed.difference[3 * index + axis]!;
          current[POSE_PARTS * slot + axis] = units[3 * slot + axis]! / UNITS_PER_METRE;
        }
      }
      if (mask & Changed.orientation) unpackOrientation(changed.orientation[index]!, current, POSE_PARTS * slot + TURN);
      if (mask & (Changed.position | Changed.orientation)) this.move(slot);
      if (mask & Changed.state) told.states.push(slot, changed.state[index]!);
      if (mask & Changed.speed) current[POSE_PARTS * slot + SPEED] = this.shown[POSE_PARTS * slot + SPEED] = changed.speed[index]!;
      if (mask & Changed.owner) told.owners.push(slot, changed.owner[index]!);
    }
  }

  private move(slot: number): void {
    if (this.is_new[slot]) {
      // It has just appeared: it is where it is.
      this.is_new[slot] = 0;
      const pose = this.current.subarray(POSE_PARTS * slot, POSE_PARTS * (slot + 1));
      this.previous.set(pose, POSE_PARTS * slot);
      this.shown.set(pose, POSE_PARTS * slot);
    }
    if (this.is_moving[slot]) return;
    this.is_moving[slot] = 1;
    this.moving[this.moving_count++] = slot;
  }

  private begin(slot: number): void {
    this.fit(this.bodies.capacity);
    this.units.fill(0, 3 * slot, 3 * slot + 3);
    this.is_new[slot] = 1;
    this.is_moving[slot] = 0;
    for (const pose of [this.previous, this.current, this.shown]) {
      pose.fill(0, POSE_PARTS * slot, POSE_PARTS * (slot + 1));
      pose[POSE_PARTS * slot + TURN + 3] = 1;
    }
  }

  private end(slot: number): void {
    if (!this.is_moving[slot]) return;
    const at = this.moving.indexOf(slot);
    this.moving[at] = this.moving[--this.moving_count]!;
    this.is_moving[slot] = 0;
  }

  private fit(capacity: number): void {
    if (this.is_new.length >= capacity) return;
    this.moving = grown(this.moving, new Int32Array(capacity));
    this.is_moving = grown(this.is_moving, new Uint8Array(capacity));
    this.is_new = grown(this.is_new, new Uint8Array(capacity));
    this.units = grown(this.units, new Float64Array(3 * capacity));
    this.previous = grown(this.previous, new Float32Array(POSE_PARTS * capacity));
    this.current = grown(this.current, new Float32Array(POSE_PARTS * capacity));
    this.shown = grown(this.shown, new Float32Array(POSE_PARTS * capacity));
  }
}
