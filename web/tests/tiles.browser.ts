// Large levels in a browser, against the fake gateway.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { encodeShapes, encodeStatics, encodeTile } from '../src/protocol/encode.ts';
import { SMALL, WAIT, launch, open, settled } from '../testing/browser.ts';
import { FakeGateway, type FakeTile } from '../testing/fake_gateway.ts';

const BODIES = 300;

// A strip of ground, 20 squares of 200 m each way along x.
function strip(): FakeTile[] {
  return Array.from({ length: 20 }, (_, at) => {
    const heights = Float32Array.from({ length: 101 * 101 }, (_, sample) => Math.sin(sample + at));
    const shapes = [{ number: 100 + at, shape: { kind: 'field' as const, columns: 101, rows: 101, spacing: 2, rim: 0, heights } }];
    const ground = { body: '900', name: 'ground', shape: 100 + at, trigger: false, position: [200 * at + 100, -8, 0], orientation: [0, 0, 0, 1] };
    return { bounds: [200 * at, -9, -100, 200 * (at + 1), -7, 100], content: encodeTile([encodeShapes(shapes), encodeStatics([ground])]) };
  });
}

test('of a large level the tiles about the place that is looked at are drawn, and go when it is left', async () => {
  const large = new FakeGateway({ page: process.env['TESSERA_PAGE'] ?? 'dist', bodies: 100, still: true, tiles: strip() });
  const browser = await launch();
  const shown = await open(browser, `${await large.listen()}/#plaza-1`, { size: SMALL });
  await shown.page.waitForFunction('window.tessera && tessera.counts.regions === 4', undefined, WAIT);
  await shown.page.evaluate('tessera.view.follows = false; tessera.view.rig.set([0, 20, 30], [0, 0, 0])');
  await shown.page.waitForFunction('tessera.counts.tiles > 0 && tessera.counts.tiles < 5', undefined, WAIT);
  const first = await shown.page.evaluate('(tessera.page.picture(), tessera.view.renderer.info.render.triangles)');
  assert.ok((first as number) > 20_000, `${first} triangles`);
  await shown.page.evaluate('tessera.view.rig.set([3000, 20, 30], [3000, 0, 0])');
  await shown.page.waitForFunction('tessera.view.tiles.known[15].content !== null && tessera.view.tiles.known[0].content === null', undefined, WAIT);
  await shown.page.waitForFunction('tessera.counts.statics === 9 + tessera.counts.tiles', undefined, WAIT);
  assert.ok(large.tiles_asked.length < 20, `${large.tiles_asked.length} asked for`);
  assert.deepEqual(shown.complaints, { errors: [], foreign: [] });
  if (process.env['TESSERA_SHOT']) await shown.page.screenshot({ path: process.env['TESSERA_SHOT'] });
  await browser.close();
  await large.close();
});

test('a level of 200 000 triangles is drawn in a few calls', async () => {
  const large = new FakeGateway({ page: process.env['TESSERA_PAGE'] ?? 'dist', bodies: BODIES, still: true, level: 200_000 });
  const browser = await launch();
  const shown = await open(browser, `${await large.listen()}/#plaza-1`, { size: SMALL });
  await shown.page.waitForFunction('window.tessera && tessera.counts.statics === 4009', undefined, WAIT);
  await settled(shown.page, BODIES);
  const { calls, triangles } = await shown.page.evaluate('(tessera.page.picture(), { ...tessera.view.renderer.info.render })') as { calls: number; triangles: number };
  assert.ok(triangles > 200_000, `${triangles} triangles`);
  assert.ok(calls < 50, `${calls} calls`);
  assert.deepEqual(shown.complaints, { errors: [], foreign: [] });
  await browser.close();
  await large.close();
});
