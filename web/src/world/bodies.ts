// Bodies: what the page knows of each moving body, in columns, so that thousands cost little.
//
// A body has a slot, an index of the columns, from when it appears until it vanishes. Poses are 8 numbers: position x, y,
// z, one that is not used, and orientation x, y, z, w: the texture that bodies are drawn from has them so. `current` is the newest pose, `previous` where the body was shown when that came, and
// `shown` lies between the two.

import { type Frame, Changed, UNITS_PER_METRE, idHalves, idText } from '../protocol/messages.ts';
import { unpackOrientation } from '../protocol/orientation.ts';
import { ProtocolError } from '../protocol/reader.ts';

export const POSE_PARTS = 8;
export const TURN = 4; // where a pose has its orientation

export interface BodyListener {
  appeared(slot: number): void;
  vanished(slot: number): void; // its columns still hold
  ownerChanged(slot: number, from: number): void;
}

export class Bodies {
  count = 0;
  owner_changes = 0;
  high = new Uint32Array(0);
  low = new Uint32Array(0);
  shape = new Uint32Array(0);
  flags = new Uint8Array(0);
  player = new Uint32Array(0);
  mass = new Float32Array(0);
  owner = new Uint32Array(0);
  state = new Uint8Array(0);
  speed = new Float32Array(0);
  previous = new Float32Array(0);
  current = new Float32Array(0);
  shown = new Float32Array(0);
  names: string[] = [];
  // Slots of the bodies, ascending by id.
  order = new Int32Array(0);
  // Slots whose pose is between previous and current.
  moving = new Int32Array(0);
  moving_count = 0;
  // Slots whose state or speed the last frame changed.
  touched = new Int32Array(0);
  touched_count = 0;

  private units = new Float64Array(0); // current position as the wire has it
  private movingSince = new Uint32Array(0); // number of the frame that put the slot into `moving`
  private frames = 0;
  private drawn_frame = 0; // number of the newest frame that a picture has shown
  private free: number[] = [];
  private listener: BodyListener;

  constructor(listener: BodyListener) {
    this.listener = listener;
  }

  get capacity(): number {
    return this.shape.length;
  }

  id(slot: number): string {
    return idText(this.high[slot]!, this.low[slot]!);
  }

  find(id: string): number {
    const halves = idHalves(id);
    if (!halves) return -1;
    const place = this.place(halves.high, halves.low);
    const slot = place < this.count ? this.order[place]! : -1;
    return slot >= 0 && this.high[slot] === halves.high && this.low[slot] === halves.low ? slot : -1;
  }

  // The first body whose name is, begins with, or contains the text.
  findName(text: string): number {
    const wanted = text.toLowerCase();
    let best = -1;
    let rank = 3;
    for (let place = 0; place < this.count && rank > 0; ++place) {
      const at = this.names[this.order[place]!]!.toLowerCase().indexOf(wanted);
      if (at < 0) continue;
      const found = at > 0 ? 2 : this.names[this.order[place]!]!.length > wanted.length ? 1 : 0;
      if (found < rank) {
        rank = found;
        best = this.order[place]!;
      }
    }
    return best;
  }

  clear(): void {
    for (let place = 0; place < this.count; ++place) this.listener.vanished(this.order[place]!);
    this.count = this.moving_count = this.touched_count = 0;
    this.free = [];
    for (let slot = this.capacity - 1; slot >= 0; --slot) this.free.push(slot);
  }

  apply(frame: Frame): void {
    ++this.frames;
    if (frame.vanished.length > 0) this.removeAll(frame.vanished);
    if (frame.appeared.length > 0) this.addAll(frame.appeared);
    this.freezeShown();
    this.change(frame);
  }

  // Whoever draws says so: until then a body that has arrived has not been seen there.
  drawn(): void {
    this.drawn_frame = this.frames;
  }

  // A body on its way goes on from where it is shown.
  private freezeShown(): void {
    const { previous, shown, current, moving } = this;
    let kept = 0;
    for (let index = 0; index < this.moving_count; ++index) {
      const slot = moving[index]!;
      let arrived = this.movingSince[slot]! <= this.drawn_frame;
      for (let part = POSE_PARTS * slot; part < POSE_PARTS * (slot + 1); ++part) {
        previous[part] = shown[part]!;
        if (shown[part] !== current[part]) arrived = false;
      }
      if (arrived) continue;
      moving[kept++] = slot;
      this.movingSince[slot] = this.frames;
    }
    this.moving_count = kept;
  }

  // Shows all that moves `fraction` of the way from the previous to the current pose.
  interpolate(fraction: number): void {
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
    this.drawn();
    if (fraction === 1) this.arrive();
  }

  // Bodies that are where the newest frame has them need no work until they move again.
  private arrive(): void {
    const { moving, moving_count, current, shown } = this;
    for (let index = 0; index < moving_count; ++index) {
      const p = POSE_PARTS * moving[index]!;
      for (let part = p; part < p + POSE_PARTS; ++part) shown[part] = current[part]!;
    }
    this.moving_count = 0;
  }

  // Ids ascend in the frame as in `order`, so one walk along both finds every body.
  private change(frame: Frame): void {
    const changed = frame.changed;
    const { order, high, low, current, units } = this;
    this.touched_count = 0;
    let place = 0;
    for (let index = 0; index < changed.count; ++index) {
      const wanted_high = changed.high[index]!;
      const wanted_low = changed.low[index]!;
      while (place < this.count) {
        const slot = order[place]!;
        if (high[slot]! > wanted_high || (high[slot] === wanted_high && low[slot]! >= wanted_low)) break;
        ++place;
      }
      const slot = place < this.count ? order[place]! : -1;
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
      if (mask & (Changed.state | Changed.speed)) this.touched[this.touched_count++] = slot;
      if (mask & Changed.state) this.state[slot] = changed.state[index]!;
      if (mask & Changed.speed) this.speed[slot] = changed.speed[index]!;
      if (mask & Changed.owner) this.setOwner(slot, changed.owner[index]!);
    }
  }

  private move(slot: number): void {
    if (this.movingSince[slot] === this.frames) return;
    if (this.movingSince[slot] === 0) {
      // It has just appeared: it is where it is.
      const pose = this.current.subarray(POSE_PARTS * slot, POSE_PARTS * (slot + 1));
      this.previous.set(pose, POSE_PARTS * slot);
      this.shown.set(pose, POSE_PARTS * slot);
    }
    this.movingSince[slot] = this.frames;
    this.moving[this.moving_count++] = slot;
  }

  private setOwner(slot: number, owner: number): void {
    const from = this.owner[slot]!;
    if (from === owner) return;
    this.owner[slot] = owner;
    if (from !== 0) ++this.owner_changes;
    this.listener.ownerChanged(slot, from);
  }

  private removeAll(ids: { high: number; low: number }[]): void {
    const gone = new Set<number>();
    for (const { high, low } of ids) {
      const place = this.place(high, low);
      const slot = place < this.count ? this.order[place]! : -1;
      if (slot < 0 || this.high[slot] !== high || this.low[slot] !== low) continue;
      this.listener.vanished(slot);
      gone.add(slot);
    }
    const keep = (slot: number) => !gone.has(slot);
    const order = this.order.subarray(0, this.count).filter(keep);
    this.order.set(order);
    this.count = order.length;
    const moving = this.moving.subarray(0, this.moving_count).filter(keep);
    this.moving.set(moving);
    this.moving_count = moving.length;
    this.free.push(...gone);
  }

  private addAll(appeared: Frame['appeared']): void {
    const known = appeared.filter((body) => this.find(idText(body.high, body.low)) >= 0);
    if (known.length > 0) this.removeAll(known);
    while (this.free.length < appeared.length) this.grow();
    const added: number[] = [];
    for (const body of appeared) {
      const slot = this.free.pop()!;
      this.high[slot] = body.high;
      this.low[slot] = body.low;
      this.shape[slot] = body.shape;
      this.flags[slot] = body.flags;
      this.player[slot] = body.player;
      this.mass[slot] = body.mass;
      this.names[slot] = body.name;
      this.owner[slot] = this.state[slot] = this.speed[slot] = 0;
      this.movingSince[slot] = 0;
      this.units.fill(0, 3 * slot, 3 * slot + 3);
      for (const pose of [this.previous, this.current, this.shown]) {
        pose.fill(0, POSE_PARTS * slot, POSE_PARTS * (slot + 1));
        pose[POSE_PARTS * slot + TURN + 3] = 1;
      }
      added.push(slot);
    }
    this.merge(added);
    for (const slot of added) this.listener.appeared(slot);
  }

  private merge(added: number[]): void {
    const all = Int32Array.from([...this.order.subarray(0, this.count), ...added]);
    all.sort((a, b) => this.high[a]! - this.high[b]! || this.low[a]! - this.low[b]!);
    this.order.set(all);
    this.count = all.length;
  }

  // The place in `order` of the first body whose id is at least this one.
  private place(high: number, low: number): number {
    let begin = 0;
    let end = this.count;
    while (begin < end) {
      const middle = (begin + end) >> 1;
      const slot = this.order[middle]!;
      if (this.high[slot]! < high || (this.high[slot] === high && this.low[slot]! < low)) begin = middle + 1;
      else end = middle;
    }
    return begin;
  }

  private grow(): void {
    const old = this.capacity;
    const capacity = Math.max(256, 2 * old);
    for (let slot = capacity - 1; slot >= old; --slot) this.free.push(slot);
    this.high = grown(this.high, new Uint32Array(capacity));
    this.low = grown(this.low, new Uint32Array(capacity));
    this.shape = grown(this.shape, new Uint32Array(capacity));
    this.flags = grown(this.flags, new Uint8Array(capacity));
    this.player = grown(this.player, new Uint32Array(capacity));
    this.mass = grown(this.mass, new Float32Array(capacity));
    this.owner = grown(this.owner, new Uint32Array(capacity));
    this.state = grown(this.state, new Uint8Array(capacity));
    this.speed = grown(this.speed, new Float32Array(capacity));
    this.order = grown(this.order, new Int32Array(capacity));
    this.moving = grown(this.moving, new Int32Array(capacity));
    this.touched = grown(this.touched, new Int32Array(capacity));
    this.movingSince = grown(this.movingSince, new Uint32Array(capacity));
    this.units = grown(this.units, new Float64Array(3 * capacity));
    this.previous = grown(this.previous, new Float32Array(POSE_PARTS * capacity));
    this.current = grown(this.current, new Float32Array(POSE_PARTS * capacity));
    this.shown = grown(this.shown, new Float32Array(POSE_PARTS * capacity));
  }
}

function grown<T extends { set(from: T): void }>(from: T, to: T): T {
  to.set(from);
  return to;
}
