// The messages of docs/viewer_protocol.md as plain data.

export const PROTOCOL = 'tessera.viewer.1';
export const VERSION = 2;
export const UNITS_PER_METRE = 1024;
export const SPEED_UNITS = 64; // units of 1 m/s

export const enum Kind {
  welcome = 1,
  shapes = 2,
  statics = 3,
  map = 4,
  frame = 5,
  visuals = 6,
  tiles = 7,
}

export interface Welcome {
  kind: Kind.welcome;
  instance: string;
  scene: string;
  tick_rate: number;
  bounds: number[]; // minimum x, y, z, maximum x, y, z
  gravity: number[];
  own_body: string; // '0': none
  own_player: number; // 0: none
  properties: { name: string; type: number }[];
}

export type Shape =
  | { kind: 'box'; half: number[] }
  | { kind: 'sphere'; radius: number }
  | { kind: 'capsule' | 'cylinder'; radius: number; half_height: number }
  | { kind: 'cone'; radius: number; height: number }
  | { kind: 'hull' | 'mesh'; vertices: Float32Array; triangles: Uint32Array }
  | { kind: 'compound'; children: { shape: number; position: number[]; orientation: number[] }[] }
  // `rim`, bits 0 to 3: towards -x, +x, -z, +z `heights` has one more column or row, of a neighbour.
  | { kind: 'field'; columns: number; rows: number; spacing: number; rim: number; heights: Float32Array }
  | { kind: 'plane'; normal: number[]; offset: number };

export interface Shapes {
  kind: Kind.shapes;
  shapes: { number: number; shape: Shape }[];
}

// A mesh of a file, and where it is in the shape that it is drawn for.
export interface VisualMesh {
  sha256: string;
  mesh: number;
  position: number[];
  orientation: number[];
  scale: number[];
}

export interface ShapeVisuals {
  shape: number;
  meshes: VisualMesh[];
}

export interface VisualsMessage {
  kind: Kind.visuals;
  visuals: ShapeVisuals[];
}

export const TRIGGER = 1;
export const KINEMATIC = 2;

export interface StaticBody {
  body: string;
  name: string;
  shape: number;
  trigger: boolean;
  position: number[];
  orientation: number[];
}

export interface Statics {
  kind: Kind.statics;
  statics: StaticBody[];
}

// A part of a large level, which is fetched by its hash when it is needed.
export interface TileEntry {
  bounds: number[]; // minimum x, y, z, maximum x, y, z
  bytes: number;
  sha256: string;
}

export interface TilesMessage {
  kind: Kind.tiles;
  tiles: TileEntry[];
}

export interface TileContent {
  shapes: Shapes['shapes'];
  visuals: ShapeVisuals[];
  statics: StaticBody[];
}

export interface Cell {
  owner: number;
  min_x: number;
  min_z: number;
  max_x: number;
  max_z: number;
}

export interface PartitionMap {
  kind: Kind.map;
  version: number;
  regions: { region: number; standby: number; host: string }[];
  cells: Cell[];
}

// Flags of a frame.
export const PAUSED = 1;
export const LIMITED = 2;

export const ASLEEP = 1;
export const EXTRAPOLATED = 2;
export const PREDICTED = 4;

export const enum Changed {
  position = 1,
  orientation = 2,
  owner = 4,
  state = 8,
  speed = 16,
}

// Ids have 64 bits, so they stand in two halves. The columns of `changed` that a body's mask does not name are not set.
export interface Frame {
  kind: Kind.frame;
  tick: number;
  time: number; // seconds of the gateway's clock
  paused: boolean;
  limited: boolean; // bodies were left out, for the budget of bytes was spent
  vanished: { high: number; low: number }[];
  appeared: Appeared[];
  changed: ChangedBodies;
}

export interface Appeared {
  high: number;
  low: number;
  shape: number;
  flags: number;
  player: number;
  name: string;
  mass: number;
}

export interface ChangedBodies {
  count: number;
  high: Uint32Array;
  low: Uint32Array;
  mask: Uint8Array;
  difference: Float64Array; // 3 a body, in units
  orientation: Uint32Array;
  owner: Uint32Array;
  state: Uint8Array;
  speed: Float32Array; // m/s
}

export type BinaryMessage = Welcome | Shapes | VisualsMessage | Statics | TilesMessage | PartitionMap | Frame;

export interface RegionStatus {
  region: number;
  host: string;
  standby: number;
  alive: boolean;
  tick: number;
  tick_rate_hz: number;
  step_p50_ms: number;
  step_p99_ms: number;
  bodies: number;
  ghosts: number;
  asleep: number;
  players: number;
  memory_bytes: number;
  broadcast_ms?: number; // both are missing before the region has sent them
  prediction_ms?: number;
}

export interface Status {
  type: 'status';
  state: string;
  reason: string;
  age_s: number;
  players: number;
  ticks_per_second: number;
  regions: RegionStatus[];
  changes: string[];
  failovers: number;
  lost_bodies: number;
  unprotected: number[];
  player_list: { player: number; name: string; connected: boolean }[];
}

export interface Detail {
  type: 'detail';
  body: string;
  name: string;
  owner: number;
  epoch: number;
  tick: number;
  position: number[];
  linear_velocity: number[];
  angular_velocity: number[];
  mass_kg: number;
  asleep: boolean;
  properties: Record<string, unknown>;
  gone?: boolean;
}

export interface Play {
  type: 'play';
  file: string;
  begin_s: number;
  end_s: number;
  at_s: number;
  paused: boolean;
  speed: number;
}

export interface Met {
  type: 'met';
  kind: 'contact_began' | 'contact_ended' | 'trigger_entered' | 'trigger_left';
  body: string;
  other: string;
  point?: number[]; // where a contact begins
  impulse?: number;
}

export interface Answer {
  type: 'answer';
  number: number;
  ok: boolean;
  text: string;
  needs?: 'token' | 'key'; // the right that was lacking
}

export type JsonMessage =
  | Status
  | Detail
  | Play
  | { type: 'events'; events: { time: string; text: string }[] }
  | Met
  | { type: 'world'; properties: Record<string, unknown> }
  | { type: 'corrected'; body: string; text: string }
  | { type: 'recording'; on: boolean; file: string; bytes: number; problem: string }
  | Answer
  | { type: 'values'; property: string; values: Record<string, unknown> }
  | { type: 'problem'; code: string; text: string; again_s?: number };

export interface WorldEntry {
  instance: string;
  scene: string;
  state: string;
  regions: number;
  players: number;
}

export interface RecordingEntry {
  file: string;
  instance: string;
  bytes: number;
  seconds: number | null;
}

export function idText(high: number, low: number): string {
  return high === 0 ? String(low) : ((BigInt(high) << 32n) | BigInt(low)).toString();
}

// The halves of an id in decimal, or null where the text is none.
export function idHalves(text: string): { high: number; low: number } | null {
  if (!/^[0-9]{1,20}$/.test(text)) return null;
  const id = BigInt(text);
  if (id >= 1n << 64n) return null;
  return { high: Number(id >> 32n), low: Number(id & 0xffffffffn) };
}
