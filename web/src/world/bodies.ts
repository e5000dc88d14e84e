// Bodies: what the page knows of each moving body, in columns, so that thousands cost little.
//
// A body has a slot, an index of the columns, from when it appears until it vanishes: the same wherever the same bodies
// have appeared and vanished since the last `clear`. Poses are 8 numbers: position x, y, z in m, speed in m/s, and
// orientation x, y, z, w, as the texture has them that bodies are drawn from.

import type { FrameTold, Poses } from '../feed/messages.ts';
import { type Appeared, idHalves, idText } from '../protocol/messages.ts';

export const POSE_PARTS = 8;
// Where a pose has its speed and its orientation.
export const SPEED = 3;
export const TURN = 4;

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
  // Where they are shown, and how many of them are on their way to where they are.
  shown = new Float32Array(0);
  moving_count = 0;
  names: string[] = [];
  // Slots of the bodies, ascending by id.
  order = new Int32Array(0);

  private free: number[] = [];
  private listener: BodyListener;

  constructor(listener: BodyListener) {
    this.listener = listener;
  }

  get capacity(): number {
    return this.shape.length;
  }

  speed(slot: number): number {
    return this.shown[POSE_PARTS * slot + SPEED]!;
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
    this.count = this.moving_count = 0;
    this.free = [];
    this.resize(0);
  }

  // Takes in what has vanished and appeared, owners and states.
  apply({ vanished, appeared, owners, states }: Pick<FrameTold, 'vanished' | 'appeared' | 'owners' | 'states'>): void {
    if (vanished.length > 0) this.removeAll(vanished);
    if (appeared.length > 0) this.addAll(appeared);
    for (let at = 0; at < states.length; at += 2) this.state[states[at]!] = states[at + 1]!;
    for (let at = 0; at < owners.length; at += 2) this.setOwner(owners[at]!, owners[at + 1]!);
  }

  // Their own are void from now on.
  pose({ shown, moving }: Poses): void {
    this.shown = shown;
    this.moving_count = moving;
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
    this.free.push(...gone);
  }

  private addAll(appeared: Appeared[]): void {
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
      this.owner[slot] = this.state[slot] = 0;
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
    // The lowest slots come first, so that what is sent and drawn by slot is short.
    this.free = [...Array.from({ length: capacity - old }, (_, at) => capacity - 1 - at), ...this.free];
    this.resize(capacity);
  }

  private resize(capacity: number): void {
    this.high = grown(this.high, new Uint32Array(capacity));
    this.low = grown(this.low, new Uint32Array(capacity));
    this.shape = grown(this.shape, new Uint32Array(capacity));
    this.flags = grown(this.flags, new Uint8Array(capacity));
    this.player = grown(this.player, new Uint32Array(capacity));
    this.mass = grown(this.mass, new Float32Array(capacity));
    this.owner = grown(this.owner, new Uint32Array(capacity));
    this.state = grown(this.state, new Uint8Array(capacity));
    this.order = grown(this.order, new Int32Array(capacity));
    this.shown = grown(this.shown, new Float32Array(POSE_PARTS * capacity));
  }
}

// Its values in a longer one; an empty one forgets them.
export function grown<T extends { length: number; set(from: T): void }>(from: T, to: T): T {
  if (to.length >= from.length) to.set(from);
  return to;
}
