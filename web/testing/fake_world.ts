// FakeWorld: a synthetic world for the fake gateway: bodies that fall, roll, cross borders and sleep, in four regions of
// which one can die and come back. It is a picture of a world, not physics: spheres push each other apart and no more.

import { encodeShapes, encodeStatics } from '../src/protocol/encode.ts';
import { ASLEEP, type Shape, type ShapeVisuals, type StaticBody } from '../src/protocol/messages.ts';

export const HALF_M = 60;
const GRAVITY = 9.81;
const TICKS = 60;
const COLUMNS = 65;
const FIELD_X = -38; // centre of the hills
const FIELD_Z = 38;

export interface FakeBody {
  id: bigint;
  name: string;
  shape: number;
  radius: number;
  mass: number;
  player: number;
  position: number[];
  velocity: number[];
  orientation: number[];
  spin: number[];
  owner: number;
  asleep: boolean;
  calm: number; // ticks
  fixed: boolean; // part of a pile: it lies where it lies
}

export interface FakeRegion {
  region: number;
  host: string;
  standby: number;
  alive: boolean;
}

export class FakeWorld {
  tick = 0;
  map_version = 1;
  paused = false;
  pace = TICKS; // ticks a second, as somebody has ordered
  orders: Record<string, unknown>[] = []; // as they came
  reported: Record<string, unknown> = {}; // fields of the status in place of its own
  limited = false; // frames say that they leave bodies out
  looked_at: number[] = []; // by the viewer that last said so
  failovers = 0;
  bodies: FakeBody[] = [];
  regions: FakeRegion[] = [1, 2, 3, 4].map((region) => ({ region, host: `host-${region}`, standby: (region % 4) + 1, alive: true }));
  events: { time: string; text: string }[] = [];
  players = new Map<number, { name: string; body: FakeBody; force: number[] }>();
  visuals: ShapeVisuals[] = [];
  level: Uint8Array[] = []; // messages of a level beyond the fake one
  private dies_at = new Map<number, number>(); // region: tick at which its standby takes over
  private next_player = 1;
  private random = 12345;

  constructor(count: number) {
    for (let index = 0; index < count; ++index) this.bodies.push(this.make(BigInt(index + 100), index));
    this.pile();
    for (const body of this.bodies) body.owner = this.regionAt(body.position);
    this.say('instance created on 4 hosts');
  }

  // A fixed sequence, so that every run begins alike.
  private chance(): number {
    this.random = (this.random * 1664525 + 1013904223) >>> 0;
    return this.random / 4294967296;
  }

  private make(id: bigint, index: number): FakeBody {
    const shape = MOVING[index % MOVING.length]!;
    const angle = 2 * Math.PI * this.chance();
    const speed = 2 + 5 * this.chance();
    const away = () => (2 * this.chance() - 1) * (HALF_M - 3);
    return {
      id,
      name: `${shape.name}-${index}`,
      shape: shape.number,
      radius: shape.radius,
      mass: shape.mass,
      player: 0,
      position: [away(), 2 + 18 * this.chance(), away()],
      velocity: [speed * Math.cos(angle), 0, speed * Math.sin(angle)],
      orientation: [0, 0, 0, 1],
      spin: [0, 0, 0],
      owner: 0,
      asleep: false,
      calm: 0,
      fixed: false,
    };
  }

  // Pyramids of boxes that sleep.
  private pile(): void {
    let id = 1000000n;
    for (const [x, z] of [[30, -30], [34, 22], [-12, -36]] as const) {
      for (let layer = 0; layer < 7; ++layer) {
        for (let row = 0; row < 7 - layer; ++row) {
          for (let column = 0; column < 7 - layer; ++column) {
            const body = this.make(id++, 0);
            body.name = `crate-${body.id}`;
            body.position = [x + (column + layer / 2) * 1.05, 0.5 + layer, z + (row + layer / 2) * 1.05];
            body.velocity = [0, 0, 0];
            body.fixed = body.asleep = true;
            this.bodies.push(body);
          }
        }
      }
    }
  }

  regionAt(position: number[]): number {
    return 1 + (position[0]! < 0 ? 0 : 1) + (position[2]! < 0 ? 0 : 2);
  }

  say(text: string): void {
    this.events.push({ time: new Date().toISOString(), text });
  }

  kill(region: number): string {
    const found = this.regions.find((one) => one.region === region);
    if (!found?.alive) return `region ${region} is not alive`;
    found.alive = false;
    this.dies_at.set(region, this.tick + 2 * TICKS);
    this.say(`region ${region} lost: host-${region} does not answer`);
    return '';
  }

  private promote(region: FakeRegion): void {
    region.alive = true;
    region.host = `host-${region.standby}`;
    ++this.map_version;
    ++this.failovers;
    this.dies_at.delete(region.region);
    this.say(`region ${region.region} promoted its standby on ${region.host}; 0 bodies lost`);
  }

  join(name: string): number {
    const player = this.next_player++;
    const body = this.make(0x8000000000000000n + BigInt(player), 1);
    Object.assign(body, { name, player, shape: CAPSULE, radius: 1.0, mass: 80, position: [2, 3, 12], velocity: [0, 0, 0] });
    body.owner = this.regionAt(body.position);
    this.bodies.push(body);
    this.players.set(player, { name, body, force: [0, 0, 0] });
    this.say(`player ${player} (${name}) joined`);
    return player;
  }

  leave(player: number): void {
    const left = this.players.get(player);
    if (!left) return;
    this.players.delete(player);
    this.bodies = this.bodies.filter((body) => body !== left.body);
    this.say(`player ${player} (${left.name}) left`);
  }

  step(): void {
    ++this.tick;
    for (const region of this.regions) {
      if (!region.alive && this.tick >= this.dies_at.get(region.region)!) this.promote(region);
    }
    for (const player of this.players.values()) this.push(player.body, player.force);
    const alive = new Set(this.regions.filter((region) => region.alive).map((region) => region.region));
    const moving = this.bodies.filter((body) => alive.has(body.owner) && !body.fixed);
    for (const body of moving) this.move(body);
    separate(moving);
    for (const body of moving) {
      const owner = this.regionAt(body.position);
      if (alive.has(owner)) body.owner = owner;
    }
  }

  private push(body: FakeBody, force: number[]): void {
    for (const axis of [0, 2]) body.velocity[axis] = 0.9 * body.velocity[axis]! + (force[axis]! / body.mass) * 0.25;
    if (force[1]! > 0 && body.position[1]! < 1.3) body.velocity[1] = 6;
    body.asleep = false;
    body.calm = 0;
  }

  private move(body: FakeBody): void {
    if (body.asleep) return;
    const [p, v] = [body.position, body.velocity];
    v[1] = v[1]! - GRAVITY / TICKS;
    for (let axis = 0; axis < 3; ++axis) p[axis] = p[axis]! + v[axis]! / TICKS;
    const ground = groundAt(p[0]!, p[2]!) + body.radius * 0.8;
    if (p[1]! < ground) {
      p[1] = ground;
      if (v[1]! < 0) v[1] = v[1]! < -1.5 ? -0.45 * v[1]! : 0;
      const slope = 0.3;
      v[0] = v[0]! * 0.9995 - ((groundAt(p[0]! + slope, p[2]!) - groundAt(p[0]! - slope, p[2]!)) / (2 * slope)) * 0.1;
      v[2] = v[2]! * 0.9995 - ((groundAt(p[0]!, p[2]! + slope) - groundAt(p[0]!, p[2]! - slope)) / (2 * slope)) * 0.1;
    }
    for (const axis of [0, 2]) {
      if (Math.abs(p[axis]!) > HALF_M - 1) {
        p[axis] = Math.sign(p[axis]!) * (HALF_M - 1);
        v[axis] = -v[axis]!;
      }
    }
    if (body.player === 0) roll(body);
    // Every third body comes to rest, as in worlds that are mostly asleep.
    if (body.id % 3n === 0n && body.player === 0) {
      v[0] = v[0]! * 0.99;
      v[2] = v[2]! * 0.99;
      body.calm = Math.hypot(v[0]!, v[1]!, v[2]!) < 0.5 ? body.calm + 1 : 0;
      body.asleep = body.calm > 20;
      if (body.asleep) body.velocity = [0, 0, 0];
    }
  }

  stateOf(body: FakeBody): number {
    return body.asleep ? ASLEEP : 0;
  }
}

// Turns a body as if it rolled.
function roll(body: FakeBody): void {
  const [x, , z] = body.velocity as [number, number, number];
  body.spin = [z / body.radius, 0, -x / body.radius];
  const [sx, sy, sz] = body.spin.map((part) => part / TICKS / 2) as [number, number, number];
  const [qx, qy, qz, qw] = body.orientation as [number, number, number, number];
  const next = [qx + sx * qw + sy * qz - sz * qy, qy + sy * qw + sz * qx - sx * qz, qz + sz * qw + sx * qy - sy * qx, qw - sx * qx - sy * qy - sz * qz];
  const length = Math.hypot(...next);
  body.orientation = next.map((part) => part / length);
}

function separate(bodies: FakeBody[]): void {
  const size = 1.6;
  const cells = new Map<number, FakeBody[]>();
  const key = (x: number, z: number) => Math.floor(x / size) * 4096 + Math.floor(z / size);
  for (const body of bodies) {
    const at = key(body.position[0]!, body.position[2]!);
    const cell = cells.get(at);
    if (cell) cell.push(body);
    else cells.set(at, [body]);
  }
  for (const [at, cell] of cells) {
    for (const step of [0, 1, 4096, 4097, 4095]) {
      const other = step === 0 ? cell : cells.get(at + step);
      if (!other) continue;
      for (const a of cell) for (const b of other) if (a !== b && (step !== 0 || a.id < b.id)) part(a, b);
    }
  }
}

function part(a: FakeBody, b: FakeBody): void {
  if (a.asleep && b.asleep) return;
  const [x, y, z] = [0, 1, 2].map((axis) => b.position[axis]! - a.position[axis]!) as [number, number, number];
  const distance = Math.hypot(x, y, z);
  const overlap = 0.85 * (a.radius + b.radius) - distance;
  if (overlap <= 0 || distance < 1e-6) return;
  [x, y, z].forEach((way, axis) => {
    const shift = (way / distance) * overlap * 0.5;
    const speed = (b.velocity[axis]! - a.velocity[axis]!) * 0.5 * Math.abs(way / distance);
    if (!a.asleep) {
      a.position[axis] = a.position[axis]! - shift;
      a.velocity[axis] = a.velocity[axis]! + speed;
    }
    if (!b.asleep) {
      b.position[axis] = b.position[axis]! + shift;
      b.velocity[axis] = b.velocity[axis]! - speed;
    }
  });
}

function hill(x: number, z: number): number {
  const edge = Math.max(0, 1 - (x * x + z * z) / 380);
  return 5.5 * edge * edge * (1 + 0.35 * Math.sin(0.55 * x) * Math.cos(0.6 * z));
}

function groundAt(x: number, z: number): number {
  return Math.max(0, hill(x - FIELD_X, z - FIELD_Z));
}

const CAPSULE = 3;
const MOVING = [
  { number: 1, name: 'crate', radius: 0.6, mass: 20 },
  { number: 2, name: 'ball', radius: 0.5, mass: 5 },
  { number: 3, name: 'capsule', radius: 0.6, mass: 8 },
  { number: 4, name: 'barrel', radius: 0.6, mass: 40 },
  { number: 5, name: 'cone', radius: 0.6, mass: 4 },
  { number: 6, name: 'gem', radius: 0.6, mass: 2 },
  { number: 7, name: 'dumbbell', radius: 0.7, mass: 12 },
  { number: 2, name: 'ball', radius: 0.5, mass: 5 },
];

const OCTAHEDRON: Shape = {
  kind: 'hull',
  vertices: new Float32Array([0.6, 0, 0, -0.6, 0, 0, 0, 0.75, 0, 0, -0.75, 0, 0, 0, 0.6, 0, 0, -0.6]),
  triangles: new Uint32Array([0, 2, 4, 4, 2, 1, 1, 2, 5, 5, 2, 0, 0, 4, 3, 4, 1, 3, 1, 5, 3, 5, 0, 3]),
};

export function fakeShapes(): { number: number; shape: Shape }[] {
  const heights = new Float32Array(COLUMNS * COLUMNS);
  const spacing = 40 / (COLUMNS - 1);
  for (let row = 0; row < COLUMNS; ++row) {
    for (let column = 0; column < COLUMNS; ++column) {
      heights[row * COLUMNS + column] = hill((column - (COLUMNS - 1) / 2) * spacing, (row - (COLUMNS - 1) / 2) * spacing) - 0.02;
    }
  }
  const shapes: Shape[] = [
    { kind: 'box', half: [0.5, 0.5, 0.5] },
    { kind: 'sphere', radius: 0.5 },
    { kind: 'capsule', radius: 0.35, half_height: 0.45 },
    { kind: 'cylinder', radius: 0.45, half_height: 0.6 },
    { kind: 'cone', radius: 0.55, height: 1.1 },
    OCTAHEDRON,
    {
      kind: 'compound',
      children: [
        { shape: 2, position: [0.55, 0, 0], orientation: [0, 0, 0, 1] },
        { shape: 2, position: [-0.55, 0, 0], orientation: [0, 0, 0, 1] },
        { shape: 8, position: [0, 0, 0], orientation: [0, 0, 0, 1] },
      ],
    },
    { kind: 'plane', normal: [0, 1, 0], offset: 0 },
    { kind: 'field', columns: COLUMNS, rows: COLUMNS, spacing, rim: 0, heights },
    arch(),
    { kind: 'box', half: [8, 0.3, 5] },
    { kind: 'box', half: [0.4, 1.5, 60] },
    { kind: 'box', half: [3, 2, 3] },
  ];
  // The bar of the dumbbell has to have a lower number than the dumbbell.
  shapes.splice(6, 0, { kind: 'box', half: [0.4, 0.12, 0.12] });
  (shapes[7] as Shape & { kind: 'compound' }).children[2]!.shape = 7;
  MOVING[6]!.number = 8;
  return shapes.map((shape, index) => ({ number: index + 1, shape }));
}

// A half ring of triangles: a mesh.
function arch(): Shape {
  const steps = 20;
  const vertices: number[] = [];
  const triangles: number[] = [];
  for (let step = 0; step <= steps; ++step) {
    const angle = (Math.PI * step) / steps;
    for (const [radius, z] of [[6, -1.5], [7.5, -1.5], [7.5, 1.5], [6, 1.5]] as const) {
      vertices.push(radius * Math.cos(angle), radius * Math.sin(angle), z);
    }
    if (step === steps) continue;
    for (let side = 0; side < 4; ++side) {
      const [a, b] = [4 * step + side, 4 * step + ((side + 1) % 4)];
      triangles.push(a, b, a + 4, b, b + 4, a + 4);
    }
  }
  return { kind: 'mesh', vertices: new Float32Array(vertices), triangles: new Uint32Array(triangles) };
}

export function fakeStatics(): StaticBody[] {
  const level = (body: number, name: string, shape: number, position: number[], orientation = [0, 0, 0, 1], trigger = false): StaticBody => ({
    body: String(body),
    name,
    shape,
    trigger,
    position,
    orientation,
  });
  const quarter = [0, Math.SQRT1_2, 0, Math.SQRT1_2];
  return [
    level(1, 'ground', 9, [0, 0, 0]),
    level(2, 'hills', 10, [FIELD_X, 0, FIELD_Z]),
    level(3, 'arch', 11, [0, 0, 0]),
    level(4, 'ramp', 12, [24, 1.4, 6], [0, 0, Math.sin(0.1), Math.cos(0.1)]),
    level(5, 'wall', 13, [-HALF_M - 0.4, 1.5, 0]),
    level(6, 'wall', 13, [HALF_M + 0.4, 1.5, 0]),
    level(7, 'wall', 13, [0, 1.5, -HALF_M - 0.4], quarter),
    level(8, 'wall', 13, [0, 1.5, HALF_M + 0.4], quarter),
    level(9, 'goal', 14, [-24, 2, -14], [0, 0, 0, 1], true),
  ];
}

const PART_TRIANGLES = 50;

// Messages of a level of so many triangles, of bodies that have a mesh of their own each, as imported ones are.
export function largeLevel(triangles: number): Uint8Array[] {
  const parts = Math.ceil(triangles / PART_TRIANGLES);
  const first = fakeShapes().length + 1;
  const messages: Uint8Array[] = [];
  for (let begin = 0; begin < parts; begin += 500) {
    const numbers = Array.from({ length: Math.min(500, parts - begin) }, (_, at) => begin + at);
    messages.push(
      encodeShapes(numbers.map((part) => ({ number: first + part, shape: fence(part) }))),
      encodeStatics(
        numbers.map((part) => ({
          body: String(50_000 + part),
          name: `part-${part}`,
          shape: first + part,
          trigger: false,
          position: [-45 + 1.4 * (part % 64), 0.2, -45 + 1.4 * Math.floor(part / 64)],
          orientation: [0, 0, 0, 1],
        })),
      ),
    );
  }
  return messages;
}

// A strip that stands up, as high as its number says.
function fence(part: number): Shape {
  const vertices = new Float32Array(3 * (PART_TRIANGLES + 2));
  const triangles = new Uint32Array(3 * PART_TRIANGLES);
  for (let at = 0; at < PART_TRIANGLES + 2; ++at) vertices.set([(at >> 1) / 26, at % 2 === 0 ? 0 : 0.3 + 0.1 * (part % 7), 0.2 * Math.sin(at)], 3 * at);
  for (let at = 0; at < PART_TRIANGLES; ++at) triangles.set(at % 2 === 0 ? [at, at + 1, at + 2] : [at + 1, at, at + 2], 3 * at);
  return { kind: 'mesh', vertices, triangles };
}
