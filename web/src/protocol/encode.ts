// Encodes what a gateway sends (docs/viewer_protocol.md), for tests and the synthetic gateway.

import {
  type Appeared,
  Changed,
  Kind,
  LIMITED,
  PAUSED,
  type PartitionMap,
  type Shape,
  type Shapes,
  type ShapeVisuals,
  type StaticBody,
  SPEED_UNITS,
  type TileEntry,
  VERSION,
  type Welcome,
} from './messages.ts';

export class Writer {
  private bytes = new Uint8Array(1024);
  private view = new DataView(this.bytes.buffer);
  private at = 0;

  // Makes room for `size` bytes before `at`.
  private room(size: number): DataView {
    this.at += size;
    if (this.at > this.bytes.length) {
      const grown = new Uint8Array(2 * this.at);
      grown.set(this.bytes);
      this.bytes = grown;
      this.view = new DataView(grown.buffer);
    }
    return this.view;
  }

  u8(value: number): void {
    this.room(1).setUint8(this.at - 1, value);
  }
  u32(value: number): void {
    this.room(4).setUint32(this.at - 4, value, true);
  }
  f32(...values: number[]): void {
    for (const value of values) this.room(4).setFloat32(this.at - 4, value, true);
  }
  f64(...values: number[]): void {
    for (const value of values) this.room(8).setFloat64(this.at - 8, value, true);
  }
  varint(value: number | bigint): void {
    if (typeof value === 'number' && value < 0x80000000) {
      let rest = value;
      for (; rest >= 128; rest >>>= 7) this.u8((rest & 127) | 128);
      return this.u8(rest);
    }
    let left = BigInt(value);
    while (left >= 128n) {
      this.u8(Number(left & 127n) | 128);
      left >>= 7n;
    }
    this.u8(Number(left));
  }
  signed(value: number): void {
    this.varint(value < 0 ? -2 * value - 1 : 2 * value);
  }
  text(value: string): void {
    const bytes = new TextEncoder().encode(value);
    this.varint(bytes.length);
    this.room(bytes.length);
    this.bytes.set(bytes, this.at - bytes.length);
  }
  done(): Uint8Array {
    return this.bytes.slice(0, this.at);
  }
}

export function encodeWelcome(message: Omit<Welcome, 'kind'>): Uint8Array {
  const out = new Writer();
  out.u8(Kind.welcome);
  out.u8(VERSION);
  out.text(message.instance);
  out.text(message.scene);
  out.varint(message.tick_rate);
  out.f64(...message.bounds, ...message.gravity);
  out.varint(BigInt(message.own_body));
  out.varint(message.own_player);
  out.varint(message.properties.length);
  for (const property of message.properties) {
    out.text(property.name);
    out.u8(property.type);
  }
  return out.done();
}

const KINDS = ['box', 'sphere', 'capsule', 'cylinder', 'cone', 'hull', 'compound', 'mesh', 'field', 'plane'];

function putShape(out: Writer, shape: Shape): void {
  out.u8(KINDS.indexOf(shape.kind));
  switch (shape.kind) {
    case 'box':
      return out.f32(...shape.half);
    case 'sphere':
      return out.f32(shape.radius);
    case 'capsule':
    case 'cylinder':
      return out.f32(shape.radius, shape.half_height);
    case 'cone':
      return out.f32(shape.radius, shape.height);
    case 'hull':
    case 'mesh':
      out.varint(shape.vertices.length / 3);
      for (const value of shape.vertices) out.f32(value);
      out.varint(shape.triangles.length / 3);
      for (const index of shape.triangles) out.u32(index);
      return;
    case 'compound':
      out.varint(shape.children.length);
      for (const child of shape.children) {
        out.varint(child.shape);
        out.f32(...child.position, ...child.orientation);
      }
      return;
    case 'field':
      out.varint(shape.columns);
      out.varint(shape.rows);
      out.f32(shape.spacing);
      out.u8(shape.rim);
      for (const height of shape.heights) out.f32(height);
      return;
    case 'plane':
      return out.f32(...shape.normal, shape.offset);
  }
}

export function encodeShapes(shapes: Shapes['shapes']): Uint8Array {
  const out = new Writer();
  out.u8(Kind.shapes);
  out.varint(shapes.length);
  for (const { number, shape } of shapes) {
    out.varint(number);
    putShape(out, shape);
  }
  return out.done();
}

export function encodeVisuals(visuals: ShapeVisuals[]): Uint8Array {
  const out = new Writer();
  out.u8(Kind.visuals);
  out.varint(visuals.length);
  for (const { shape, meshes } of visuals) {
    out.varint(shape);
    out.varint(meshes.length);
    for (const { sha256, mesh, position, orientation, scale } of meshes) {
      out.text(sha256);
      out.varint(mesh);
      out.f32(...position, ...orientation, ...scale);
    }
  }
  return out.done();
}

export function encodeTiles(tiles: TileEntry[]): Uint8Array {
  const out = new Writer();
  out.u8(Kind.tiles);
  out.varint(tiles.length);
  for (const { bounds, bytes, sha256 } of tiles) {
    out.f32(...bounds);
    out.varint(bytes);
    out.text(sha256);
  }
  return out.done();
}

// The content of a tile.
export function encodeTile(messages: Uint8Array[]): Uint8Array {
  const out = new Writer();
  for (const message of messages) {
    out.varint(message.length);
    for (const byte of message) out.u8(byte);
  }
  return out.done();
}

export function encodeStatics(statics: StaticBody[]): Uint8Array {
  const out = new Writer();
  out.u8(Kind.statics);
  out.varint(statics.length);
  for (const body of statics) {
    out.varint(BigInt(body.body));
    out.text(body.name);
    out.varint(body.shape);
    out.u8(body.trigger ? 1 : 0);
    out.f64(...body.position);
    out.f32(...body.orientation);
  }
  return out.done();
}

export function encodeMap(message: Omit<PartitionMap, 'kind'>): Uint8Array {
  const out = new Writer();
  out.u8(Kind.map);
  out.varint(message.version);
  out.varint(message.regions.length);
  for (const region of message.regions) {
    out.varint(region.region);
    out.varint(region.standby);
    out.text(region.host);
  }
  out.varint(message.cells.length);
  for (const cell of message.cells) {
    out.varint(cell.owner);
    out.f64(cell.min_x, cell.min_z, cell.max_x, cell.max_z);
  }
  return out.done();
}

export interface ChangedBody {
  id: bigint;
  difference?: number[]; // units
  orientation?: number; // packed
  owner?: number;
  state?: number;
  speed?: number; // m/s
}

export interface FrameToEncode {
  tick: number;
  time: number;
  paused: boolean;
  limited?: boolean;
  vanished: bigint[]; // ascending
  appeared: (Omit<Appeared, 'high' | 'low'> & { id: bigint })[];
  changed: ChangedBody[]; // ascending
}

function putChanged(out: Writer, body: ChangedBody): void {
  out.u8(
    (body.difference ? Changed.position : 0) |
      (body.orientation !== undefined ? Changed.orientation : 0) |
      (body.owner !== undefined ? Changed.owner : 0) |
      (body.state !== undefined ? Changed.state : 0) |
      (body.speed !== undefined ? Changed.speed : 0),
  );
  for (const part of body.difference ?? []) out.signed(part);
  if (body.orientation !== undefined) out.u32(body.orientation);
  if (body.owner !== undefined) out.varint(body.owner);
  if (body.state !== undefined) out.u8(body.state);
  if (body.speed !== undefined) out.varint(Math.round(body.speed * SPEED_UNITS));
}

export function encodeFrame(frame: FrameToEncode): Uint8Array {
  const out = new Writer();
  out.u8(Kind.frame);
  out.varint(frame.tick);
  out.f64(frame.time);
  out.u8((frame.paused ? PAUSED : 0) | (frame.limited ? LIMITED : 0));
  let last = 0n;
  out.varint(frame.vanished.length);
  for (const id of frame.vanished) {
    out.varint(id - last);
    last = id;
  }
  out.varint(frame.appeared.length);
  for (const body of frame.appeared) {
    out.varint(body.id);
    out.varint(body.shape);
    out.u8(body.flags);
    out.varint(body.player);
    out.text(body.name);
    out.f32(body.mass);
  }
  last = 0n;
  out.varint(frame.changed.length);
  for (const body of frame.changed) {
    out.varint(body.id - last);
    last = body.id;
    putChanged(out, body);
  }
  return out.done();
}
