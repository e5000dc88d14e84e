import assert from 'node:assert/strict';
import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { decode } from '../src/protocol/decode.ts';
import { Writer, encodeFrame, encodeMap, encodeShapes, encodeStatics, encodeWelcome } from '../src/protocol/encode.ts';
import { Kind, idHalves, idText } from '../src/protocol/messages.ts';
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
  assert.deepEqual([message.tick, message.time, message.paused], [2 ** 40, 1.5, true]);
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
  later[1] = 2;
  assert.throws(() => decode(later), /version 2/);
});

test('texts of ids are decimal and have 64 bits', () => {
  assert.deepEqual(idHalves(String(MADE)), { high: 0x80000001, low: 2 });
  for (const text of ['', '-1', '1.5', 'crate', '18446744073709551616']) assert.equal(idHalves(text), null);
});

// The gateway's own encoder writes these; each is one message.
test('what the gateway encodes is read', { skip: !existsSync(GOLDEN) }, () => {
  const files = readdirSync(GOLDEN).filter((name) => name.endsWith('.bin'));
  for (const file of files) {
    const message = decode(readFileSync(join(GOLDEN, file)));
    const kind = ['', 'welcome', 'shapes', 'statics', 'map', 'frame'][message.kind]!;
    assert.ok(file.includes(kind), `${file} holds a ${kind}`);
  }
});
