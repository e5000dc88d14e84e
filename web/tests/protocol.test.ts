import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { decode, decodeTile } from '../src/protocol/decode.ts';
import { Writer, encodeFrame, encodeMap, encodeShapes, encodeStatics, encodeTile, encodeTiles, encodeVisuals, encodeWelcome } from '../src/protocol/encode.ts';
import { type BinaryMessage, type Frame, Kind, SPEED_UNITS, idHalves, idText } from '../src/protocol/messages.ts';
import { packOrientation, unpackOrientation } from '../src/protocol/orientation.ts';
import { ProtocolError, Reader } from '../src/protocol/reader.ts';
import { fakeShapes, fakeStatics } from '../testing/fake_world.ts';

const GOLDEN = process.env['TESSERA_GOLDEN'] ?? '../gateway/testing/golden';
const MADE = 0x8000_0001_0000_0002n; // an id with its highest bit, as made bodies have

const welcome = {
  instance: 'plaza-1',
  scene: 'plaza',
  tick_rate: 60,
  bounds: [-1, -2, -3, 1, 2, 3],
  gravity: [0, -9.81, 0],
  own_body: String(MADE),
  own_player: 3,
  properties: [{ name: 'health', type: 2 }],
};

test('a welcome comes back as it was sent', () => {
  assert.deepEqual(decode(encodeWelcome(welcome)), { kind: Kind.welcome, ...welcome });
});

test('every shape of the scene format comes back as it was sent', () => {
  const shapes = fakeShapes();
  const message = decode(encodeShapes(shapes));
  assert.equal(message.kind, Kind.shapes);
  if (message.kind !== Kind.shapes) return;
  assert.deepEqual(message.shapes.map(({ shape }) => shape.kind), shapes.map(({ shape }) => shape.kind));
  assert.equal(new Set(shapes.map(({ shape }) => shape.kind)).size, 10);
  assert.deepEqual(message.shapes[5], shapes[5]);
});

test('visuals come back as they were sent, and a file is named by a hash alone', () => {
  const mesh = { sha256: '0123456789abcdef'.repeat(4), mesh: 7, position: [1, -2, 0.5], orientation: [0, 0, 0, 1], scale: [-1, 2, 1] };
  const visuals = [{ shape: 3, meshes: [mesh, { ...mesh, mesh: 0 }] }, { shape: 300, meshes: [mesh] }];
  assert.deepEqual(decode(encodeVisuals(visuals)), { kind: Kind.visuals, visuals });
  for (const sha256 of ['', '../secret', 'A'.repeat(64), 'a'.repeat(63)]) {
    assert.throws(() => decode(encodeVisuals([{ shape: 1, meshes: [{ ...mesh, sha256 }] }])), ProtocolError);
  }
});

test('the list of tiles comes back as it was sent, and a tile is named by a hash alone', () => {
  const tile = { bounds: [-8, -1, 0, 8.5, 3, 16], bytes: 123456, sha256: '0123456789abcdef'.repeat(4) };
  const tiles = [tile, { ...tile, bytes: 1 }];
  assert.deepEqual(decode(encodeTiles(tiles)), { kind: Kind.tiles, tiles });
  for (const sha256 of ['', '../secret', 'A'.repeat(64)]) {
    assert.throws(() => decode(encodeTiles([{ ...tile, sha256: sha256.padEnd(64, '/') }])), ProtocolError);
  }
});

test('a tile holds shapes, visuals and statics, and nothing else', () => {
  const shapes = fakeShapes();
  const statics = fakeStatics();
  const content = decodeTile(encodeTile([encodeShapes(shapes), encodeStatics(statics), encodeShapes(shapes.slice(0, 1))]));
  assert.equal(content.shapes.length, shapes.length + 1);
  assert.deepEqual({ kind: Kind.statics, statics: content.statics }, decode(encodeStatics(statics)));
  assert.deepEqual(content.visuals, []);
  assert.throws(() => decodeTile(encodeTile([encodeWelcome(welcome)])), /kind 1 in a tile/);
  const whole = encodeTile([encodeShapes(shapes)]);
  assert.throws(() => decodeTile(whole.subarray(0, whole.length - 1)), ProtocolError);
});

test('statics and the map come back as they were sent', () => {
  const statics = decode(encodeStatics(fakeStatics()));
  assert.equal(statics.kind === Kind.statics && statics.statics[7]!.name, 'wall');
  const map = {
    version: 7,
    regions: [{ region: 1, standby: 2, host: 'h1' }],
    cells: [{ owner: 1, min_x: -5.5, min_z: -6, max_x: 7, max_z: 8 }],
  };
  assert.deepEqual(decode(encodeMap(map)), { kind: Kind.map, ...map });
});

test('a frame keeps ids of 64 bits, signs and what its masks name', () => {
  const message = decode(
    encodeFrame({
      tick: 2 ** 40,
      time: 1.5,
      paused: true,
      limited: true,
      vanished: [5n, MADE],
      appeared: [{ id: 9n, shape: 1, flags: 2, player: 4, name: 'ada', mass: 2.5 }],
      changed: [
        { id: 9n, difference: [-1, 0, 1_000_000_000], orientation: 0xfedcba98, owner: 300, state: 1, speed: 2.5 },
        { id: 0xffffffffn, speed: 1 },
        { id: MADE, owner: 2 },
      ],
    }),
  );
  assert.ok(message.kind === Kind.frame);
  assert.deepEqual([message.tick, message.time, message.paused, message.limited], [2 ** 40, 1.5, true, true]);
  assert.deepEqual(message.vanished.map(({ high, low }) => idText(high, low)), ['5', String(MADE)]);
  assert.equal(message.appeared[0]!.name, 'ada');
  const changed = message.changed;
  assert.equal(changed.count, 3);
  assert.deepEqual([0, 1, 2].map((at) => idText(changed.high[at]!, changed.low[at]!)), ['9', '4294967295', String(MADE)]);
  assert.deepEqual([...changed.difference.subarray(0, 3)], [-1, 0, 1_000_000_000]);
  assert.deepEqual([changed.orientation[0], changed.owner[0], changed.speed[0], changed.owner[2]], [0xfedcba98, 300, 2.5, 2]);
  assert.deepEqual([...changed.mask.subarray(0, 3)], [31, 16, 4]);
});

test('an orientation keeps its angle to a tenth of a degree', () => {
  const out = [0, 0, 0, 0];
  for (const raw of [[0, 0, 0, 1], [1, 0, 0, 0], [0.5, -0.5, 0.5, -0.5], [-0.1, 0.7, 0.2, 0.67], [0, -1, 0, 0.01]]) {
    const length = Math.hypot(...raw);
    const unit = raw.map((part) => part / length);
    unpackOrientation(packOrientation(unit), out, 0);
    const cosine = Math.abs(out.reduce((sum, part, at) => sum + part * unit[at]!, 0));
    assert.ok(2 * Math.acos(Math.min(1, cosine)) < 0.004, `${raw.join()} became ${out.join()}`);
  }
});

test('every message that is cut short is refused, and so is one that is too long', () => {
  for (const whole of [encodeWelcome(welcome), encodeShapes(fakeShapes().slice(0, 8)), encodeStatics(fakeStatics())]) {
    for (let size = 0; size < whole.length; ++size) assert.throws(() => decode(whole.subarray(0, size)), ProtocolError);
    assert.throws(() => decode(new Uint8Array([...whole, 0])), ProtocolError);
  }
});

test('a count that does not fit reserves nothing', () => {
  const out = new Writer();
  out.u8(Kind.shapes);
  out.varint(2n ** 52n);
  assert.throws(() => decode(out.done()), /do not fit/);
});

test('numbers that no gateway may send are refused', () => {
  assert.throws(() => decode(new Uint8Array([77])), /unknown kind/);
  assert.throws(() => new Reader(new Uint8Array([255, 255, 255, 255, 255, 255, 255, 255, 255, 2])).varint64(), /64 bits/);
  const infinite = new Writer();
  infinite.f32(Infinity);
  assert.throws(() => new Reader(infinite.done()).f32(), /not finite/);
  const later = encodeWelcome(welcome);
  later[1] = 3;
  assert.throws(() => decode(later), /version 3/);
});

test('texts of ids are decimal and have 64 bits', () => {
  assert.deepEqual(idHalves(String(MADE)), { high: 0x80000001, low: 2 });
  for (const text of ['', '-1', '1.5', 'crate', '18446744073709551616']) assert.equal(idHalves(text), null);
});

// The gateway's own encoder writes these: each file is one message, beside what is in it.
interface GoldenFrame {
  message: string;
  tick: number;
  vanished: number[];
  appeared: { body: number; shape: number; player: number; name: string; mass_kg: number }[];
  changed: { body: number; position?: number[]; orientation?: number; owner?: number; state?: number; speed?: number }[];
  regions: { region: number; standby: number; host: string }[];
  cells: { owner: number; area: number[] }[];
  shapes: { shape: number; kind: number }[];
  statics: { body: number; name: string; position: number[] }[];
  visuals: { shape: number; meshes: { sha256: string; mesh: number; position: number[]; orientation: number[]; scale: number[] }[] }[];
  instance: string;
  own_body: number;
  bounds: number[];
}
const KINDS = ['box', 'sphere', 'capsule', 'cylinder', 'cone', 'hull', 'compound', 'mesh', 'field', 'plane'];

function check(message: BinaryMessage, wanted: GoldenFrame): void {
  switch (message.kind) {
    case Kind.welcome:
      assert.deepEqual([message.instance, message.own_body, message.bounds], [wanted.instance, String(wanted.own_body), wanted.bounds]);
      return;
    case Kind.shapes:
      assert.deepEqual(message.shapes.map(({ number, shape }) => [number, KINDS.indexOf(shape.kind)]), wanted.shapes.map(({ shape, kind }) => [shape, kind]));
      return;
    case Kind.visuals:
      assert.deepEqual(message.visuals, wanted.visuals);
      return;
    case Kind.statics:
      assert.deepEqual(message.statics.map((one) => [one.body, one.name, one.position]), wanted.statics.map((one) => [String(one.body), one.name, one.position]));
      return;
    case Kind.map:
      assert.deepEqual(message.regions, wanted.regions);
      assert.deepEqual(message.cells.map((cell) => [cell.owner, cell.min_x, cell.min_z, cell.max_x, cell.max_z]), wanted.cells.map((cell) => [cell.owner, ...cell.area]));
      return;
    case Kind.frame:
      checkFrame(message, wanted);
  }
}

// The files give positions; a frame has what each differs from the last.
const positions = new Map<number, number[]>();

function checkFrame(frame: Frame, wanted: GoldenFrame): void {
  assert.equal(frame.tick, wanted.tick);
  assert.deepEqual(frame.vanished.map(({ high, low }) => idText(high, low)), wanted.vanished.map(String));
  assert.deepEqual(frame.appeared.map((one) => [idText(one.high, one.low), one.shape, one.player, one.name, one.mass]), wanted.appeared.map((one) => [String(one.body), one.shape, one.player, one.name, one.mass_kg]));
  const { changed } = frame;
  assert.equal(changed.count, wanted.changed.length);
  wanted.changed.forEach((body, at) => {
    assert.equal(idText(changed.high[at]!, changed.low[at]!), String(body.body));
    if (body.position) {
      const last = positions.get(body.body) ?? [0, 0, 0];
      assert.deepEqual([...changed.difference.subarray(3 * at, 3 * at + 3)].map((part, axis) => part + last[axis]!), body.position);
      positions.set(body.body, body.position);
    }
    if (body.orientation !== undefined) assert.equal(changed.orientation[at], body.orientation);
    if (body.owner !== undefined) assert.equal(changed.owner[at], body.owner);
    if (body.state !== undefined) assert.equal(changed.state[at], body.state);
    if (body.speed !== undefined) assert.equal(changed.speed[at]! * SPEED_UNITS, body.speed);
  });
}

test('what the gateway encodes is read', () => {
  const files = readdirSync(GOLDEN).filter((name) => name.endsWith('.bin'));
  assert.ok(files.length > 0);
  for (const file of files) {
    const text = readFileSync(join(GOLDEN, file.replace('.bin', '.json')), 'utf8');
    check(decode(readFileSync(join(GOLDEN, file))), JSON.parse(text) as GoldenFrame);
  }
});
