// Decodes the binary messages of docs/viewer_protocol.md. Pure: bytes in, a message or a ProtocolError out.

import {
  type Appeared,
  type BinaryMessage,
  Changed,
  type ChangedBodies,
  type Frame,
  Kind,
  LIMITED,
  PAUSED,
  type PartitionMap,
  type Shape,
  type Shapes,
  SPEED_UNITS,
  type ShapeVisuals,
  type Statics,
  TRIGGER,
  type TileContent,
  type TilesMessage,
  VERSION,
  type VisualMesh,
  type VisualsMessage,
  type Welcome,
  idText,
} from './messages.ts';
import { Reader } from './reader.ts';

export function decode(data: ArrayBuffer | Uint8Array): BinaryMessage {
  const reader = new Reader(data);
  const message = decodeBody(reader, reader.u8());
  reader.end();
  return message;
}

function decodeBody(reader: Reader, kind: number): BinaryMessage {
  switch (kind) {
    case Kind.welcome:
      return welcome(reader);
    case Kind.shapes:
      return shapes(reader);
    case Kind.statics:
      return statics(reader);
    case Kind.map:
      return partitionMap(reader);
    case Kind.frame:
      return frame(reader);
    case Kind.visuals:
      return visuals(reader);
    case Kind.tiles:
      return tiles(reader);
    default:
      return reader.fail(`unknown kind of message ${kind}`);
  }
}

function id(reader: Reader): string {
  reader.varint64();
  return idText(reader.high, reader.low);
}

function welcome(reader: Reader): Welcome {
  const version = reader.u8();
  if (version !== VERSION) reader.fail(`the gateway speaks version ${version}, this page ${VERSION}: reload the page`);
  const message: Welcome = {
    kind: Kind.welcome,
    instance: reader.text(),
    scene: reader.text(),
    tick_rate: reader.varint(),
    bounds: reader.f64s(6),
    gravity: reader.f64s(3),
    own_body: id(reader),
    own_player: reader.varint(),
    properties: [],
  };
  for (let left = reader.count(2); left > 0; --left) {
    message.properties.push({ name: reader.text(), type: reader.u8() });
  }
  return message;
}

function shapes(reader: Reader): Shapes {
  const message: Shapes = { kind: Kind.shapes, shapes: [] };
  for (let left = reader.count(6); left > 0; --left) {
    const number = reader.varint();
    message.shapes.push({ number, shape: shape(reader, number) });
  }
  return message;
}

function shape(reader: Reader, number: number): Shape {
  const kind = reader.u8();
  switch (kind) {
    case 0:
      return { kind: 'box', half: [reader.f32(), reader.f32(), reader.f32()] };
    case 1:
      return { kind: 'sphere', radius: reader.f32() };
    case 2:
    case 3:
      return { kind: kind === 2 ? 'capsule' : 'cylinder', radius: reader.f32(), half_height: reader.f32() };
    case 4:
      return { kind: 'cone', radius: reader.f32(), height: reader.f32() };
    case 5:
    case 7:
      return triangles(reader, kind === 5 ? 'hull' : 'mesh');
    case 6:
      return compound(reader, number);
    case 8:
      return field(reader);
    case 9:
      return { kind: 'plane', normal: [reader.f32(), reader.f32(), reader.f32()], offset: reader.f32() };
    default:
      return reader.fail(`unknown kind of shape ${kind}`);
  }
}

function triangles(reader: Reader, kind: 'hull' | 'mesh'): Shape {
  const count = reader.count(12);
  const vertices = reader.f32s(3 * count);
  const indices = reader.u32s(3 * reader.count(12));
  for (const index of indices) {
    if (index >= count) reader.fail(`triangle with vertex ${index} of ${count}`);
  }
  return { kind, vertices, triangles: indices };
}

function compound(reader: Reader, number: number): Shape {
  const children = [];
  for (let left = reader.count(29); left > 0; --left) {
    const child = reader.varint();
    if (child === 0 || child >= number) reader.fail(`compound ${number} with child ${child}`);
    children.push({ shape: child, position: [...reader.f32s(3)], orientation: [...reader.f32s(4)] });
  }
  return { kind: 'compound', children };
}

function field(reader: Reader): Shape {
  const columns = reader.varint();
  const rows = reader.varint();
  const spacing = reader.f32();
  const rim = reader.u8();
  const wide = columns + side(rim, 0) + side(rim, 1);
  const deep = rows + side(rim, 2) + side(rim, 3);
  if (columns < 2 || rows < 2 || rim > 15 || 4 * wide * deep > reader.left) reader.fail(`height field of ${columns} x ${rows}`);
  return { kind: 'field', columns, rows, spacing, rim, heights: reader.f32s(wide * deep) };
}

// 1 if a bit says that there is something on a side, else 0.
function side(rim: number, bit: number): number {
  return (rim >> bit) & 1;
}

function visuals(reader: Reader): VisualsMessage {
  const message: VisualsMessage = { kind: Kind.visuals, visuals: [] };
  for (let left = reader.count(2); left > 0; --left) {
    const visual: ShapeVisuals = { shape: reader.varint(), meshes: [] };
    for (let meshes = reader.count(42); meshes > 0; --meshes) visual.meshes.push(visualMesh(reader));
    message.visuals.push(visual);
  }
  return message;
}

// It becomes part of an address.
function hash(reader: Reader, of: string): string {
  const sha256 = reader.text();
  if (!/^[0-9a-f]{64}$/.test(sha256)) reader.fail(`a ${of} whose name is no hash`);
  return sha256;
}

function visualMesh(reader: Reader): VisualMesh {
  return { sha256: hash(reader, 'mesh file'), mesh: reader.varint(), position: [...reader.f32s(3)], orientation: [...reader.f32s(4)], scale: [...reader.f32s(3)] };
}

function statics(reader: Reader): Statics {
  const message: Statics = { kind: Kind.statics, statics: [] };
  for (let left = reader.count(44); left > 0; --left) {
    message.statics.push({
      body: id(reader),
      name: reader.text(),
      shape: reader.varint(),
      trigger: (reader.u8() & TRIGGER) !== 0,
      position: reader.f64s(3),
      orientation: [...reader.f32s(4)],
    });
  }
  return message;
}

function tiles(reader: Reader): TilesMessage {
  const message: TilesMessage = { kind: Kind.tiles, tiles: [] };
  for (let left = reader.count(90); left > 0; --left) {
    message.tiles.push({ bounds: [...reader.f32s(6)], bytes: reader.varint(), sha256: hash(reader, 'tile') });
  }
  return message;
}

// The content of a tile: its messages, each behind its length.
export function decodeTile(data: ArrayBuffer | Uint8Array): TileContent {
  const reader = new Reader(data);
  const content: TileContent = { shapes: [], visuals: [], statics: [] };
  while (reader.left > 0) {
    const message = decode(reader.bytesOf(reader.count(1)));
    if (message.kind === Kind.shapes) content.shapes.push(...message.shapes);
    else if (message.kind === Kind.visuals) content.visuals.push(...message.visuals);
    else if (message.kind === Kind.statics) content.statics.push(...message.statics);
    else reader.fail(`a message of kind ${message.kind} in a tile`);
  }
  return content;
}

function partitionMap(reader: Reader): PartitionMap {
  const message: PartitionMap = { kind: Kind.map, version: reader.varint(), regions: [], cells: [] };
  for (let left = reader.count(3); left > 0; --left) {
    message.regions.push({ region: reader.varint(), standby: reader.varint(), host: reader.text() });
  }
  for (let left = reader.count(33); left > 0; --left) {
    const owner = reader.varint();
    message.cells.push({
      owner,
      min_x: reader.f64(),
      min_z: reader.f64(),
      max_x: reader.f64(),
      max_z: reader.f64(),
    });
  }
  return message;
}

function frame(reader: Reader): Frame {
  const tick = reader.varint();
  const time = reader.f64();
  const flags = reader.u8();
  const vanished = [];
  let high = 0;
  let low = 0;
  for (let left = reader.count(1); left > 0; --left) {
    reader.varint64();
    const sum = low + reader.low;
    low = sum >>> 0;
    high = (high + reader.high + (sum > 0xffffffff ? 1 : 0)) >>> 0;
    vanished.push({ high, low });
  }
  const appeared: Appeared[] = [];
  for (let left = reader.count(9); left > 0; --left) appeared.push(appearedBody(reader));
  return {
    kind: Kind.frame,
    tick,
    time,
    paused: (flags & PAUSED) !== 0,
    limited: (flags & LIMITED) !== 0,
    vanished,
    appeared,
    changed: changedBodies(reader),
  };
}

function appearedBody(reader: Reader): Appeared {
  reader.varint64();
  return {
    high: reader.high,
    low: reader.low,
    shape: reader.varint(),
    flags: reader.u8(),
    player: reader.varint(),
    name: reader.text(),
    mass: reader.f32(),
  };
}

// The hot part: thousands of bodies, tens of times a second. Its columns are used again by the next frame.
let columns = makeColumns(1024);

function makeColumns(capacity: number): ChangedBodies {
  return {
    count: 0,
    high: new Uint32Array(capacity),
    low: new Uint32Array(capacity),
    mask: new Uint8Array(capacity),
    difference: new Float64Array(3 * capacity),
    orientation: new Uint32Array(capacity),
    owner: new Uint32Array(capacity),
    state: new Uint8Array(capacity),
    speed: new Float32Array(capacity),
  };
}

function changedBodies(reader: Reader): ChangedBodies {
  const count = reader.count(2);
  if (count > columns.mask.length) columns = makeColumns(2 * count);
  const out = columns;
  out.count = count;
  let high = 0;
  let low = 0;
  for (let index = 0; index < count; ++index) {
    reader.varint64();
    const sum = low + reader.low;
    low = sum >>> 0;
    high = (high + reader.high + (sum > 0xffffffff ? 1 : 0)) >>> 0;
    const mask = reader.u8();
    out.high[index] = high;
    out.low[index] = low;
    out.mask[index] = mask;
    if (mask & Changed.position) {
      out.difference[3 * index] = reader.signed();
      out.difference[3 * index + 1] = reader.signed();
      out.difference[3 * index + 2] = reader.signed();
    }
    if (mask & Changed.orientation) out.orientation[index] = reader.u32();
    if (mask & Changed.owner) out.owner[index] = reader.varint();
    if (mask & Changed.state) out.state[index] = reader.u8();
    if (mask & Changed.speed) out.speed[index] = reader.varint() / SPEED_UNITS;
  }
  return out;
}
