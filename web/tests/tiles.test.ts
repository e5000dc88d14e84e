// Tiles of a large level: the nearest come first, a bounded part of them is there, and what is far goes.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { TileContent, TileEntry } from '../src/protocol/messages.ts';
import { Tiles } from '../src/view/tiles.ts';

const EDGE = 100;

// A row of tiles along x.
function row(count: number, bytes: number): TileEntry[] {
  return Array.from({ length: count }, (_, at) => ({
    bounds: [EDGE * at, 0, 0, EDGE * (at + 1), 1, EDGE],
    bytes,
    sha256: String(at).padStart(64, '0'),
  }));
}

interface Watched {
  tiles: Tiles;
  asked: number[];
  here: Set<number>;
  problems: string[];
  answer(ok?: boolean): Promise<void>; // all that is asked
}

function watch(): Watched {
  let open: { resolve: (content: TileContent) => void; reject: (error: Error) => void }[] = [];
  const asked: number[] = [];
  const here = new Set<number>();
  const problems: string[] = [];
  const tiles = new Tiles(
    {
      came: (tile) => here.add(tile),
      gone: (tile) => here.delete(tile),
      problem: (text) => problems.push(text),
    },
    ({ sha256 }) => {
      asked.push(Number(sha256));
      return new Promise((resolve, reject) => open.push({ resolve, reject }));
    },
  );
  const answer = async (ok = true) => {
    while (open.length > 0) {
      const waiting = open;
      open = [];
      for (const { resolve, reject } of waiting) {
        if (ok) resolve({ shapes: [], visuals: [], statics: [] });
        else reject(new Error('the gateway answers 404'));
      }
      await new Promise((turn) => setImmediate(turn));
    }
  };
  return { tiles, asked, here, problems, answer };
}

const sorted = (set: Set<number>) => [...set].sort((a, b) => a - b);

test('the nearest tiles come first, and only those within reach', async () => {
  const { tiles, asked, here, answer } = watch();
  tiles.begin(row(50, 1000));
  tiles.lookAt([1050, 0, 50], 10);
  assert.deepEqual(asked.slice(0, 1), [10]);
  assert.ok(asked.length <= 4, `${asked.length} at once`);
  await answer();
  assert.deepEqual(sorted(here), [7, 8, 9, 10, 11, 12, 13]);
  assert.equal(tiles.drawn, 7);
});

test('what is left behind goes, a little beyond the reach at which it comes', async () => {
  const { tiles, asked, here, answer } = watch();
  tiles.begin(row(50, 1000));
  tiles.lookAt([1050, 0, 50], 10);
  await answer();
  tiles.lookAt([1110, 0, 50], 10);
  await answer();
  assert.ok(here.has(7), 'it stays while it is hardly further away');
  tiles.lookAt([3050, 0, 50], 10);
  await answer();
  assert.deepEqual(sorted(here), [27, 28, 29, 30, 31, 32, 33]);
  assert.equal(new Set(asked).size, asked.length, 'nothing is asked for twice');
});

test('from far away more comes, but no more than a browser holds', async () => {
  const { tiles, here, answer } = watch();
  tiles.begin(row(50, 8 << 20));
  tiles.lookAt([2550, 0, 50], 5000);
  await answer();
  assert.equal(here.size, 12);
  assert.ok(here.has(25));
});

test('a tile that cannot be had is said once, and costs the others nothing', async () => {
  const { tiles, here, problems, answer } = watch();
  tiles.begin(row(3, 1000));
  tiles.lookAt([50, 0, 50], 10);
  await answer(false);
  assert.equal(here.size, 0);
  assert.equal(problems.length, 1);
  assert.match(problems[0]!, /404/);
});

test('what comes for a level before is void', async () => {
  const { tiles, here, answer } = watch();
  tiles.begin(row(3, 1000));
  tiles.lookAt([50, 0, 50], 10);
  tiles.clear();
  await answer();
  assert.equal(here.size, 0);
  tiles.begin(row(3, 1000));
  tiles.lookAt([50, 0, 50], 10);
  await answer();
  assert.equal(here.size, 3);
});
