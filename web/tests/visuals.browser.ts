// Bodies and levels that are drawn by the meshes of a file, in a browser, against fake gateways that keep the files.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { type Complaints, SMALL, WAIT, launch, messagesOf, open, pixelAt, settled, shows } from '../testing/browser.ts';
import { FakeGateway } from '../testing/fake_gateway.ts';
import { makeGlb, makePng, pyramid, sha256Of } from '../testing/glb_file.ts';

const BODIES = 300;

let browser: Browser;

before(async () => {
  browser = await launch();
});

after(async () => {
  await browser?.close();
});

// A page of its own, of a world whose crates and ramp are drawn by the meshes of a file.
async function openWithVisuals(of: FakeGateway): Promise<{ shown: Page; heard: Complaints; close: () => Promise<void> }> {
  const at = await of.listen();
  const { page: shown, complaints: heard } = await open(browser, `${at}/#plaza-1`, { size: SMALL });
  await settled(shown, BODIES);
  return {
    shown,
    heard,
    close: async () => {
      await shown.context().close();
      await of.close();
    },
  };
}

const CRATE = 1;
const RAMP = 12;

function withVisuals(files: Map<string, Buffer>, sha256: string): FakeGateway {
  const mesh = (number: number, more = {}) => ({ sha256, mesh: number, position: [0, -0.5, 0], orientation: [0, 0, 0, 1], scale: [0.5, 0.5, 0.5], ...more });
  const visuals = [{ shape: CRATE, meshes: [mesh(0)] }, { shape: RAMP, meshes: [mesh(1, { position: [0, 0, 0], scale: [8, 4, 5] })] }];
  return new FakeGateway({ page: process.env['TESSERA_PAGE'] ?? 'dist', bodies: BODIES, still: true, visuals, files });
}

test('bodies and the level are drawn by the meshes that their shapes refer to', async () => {
  const glb = makeGlb([pyramid(2, [0.9, 0.05, 0.05]), pyramid(1, [0.05, 0.9, 0.05])]);
  const { shown, heard, close } = await openWithVisuals(withVisuals(new Map([[sha256Of(glb), glb]]), sha256Of(glb)));
  await shown.waitForFunction('tessera.counts.visuals === 2 && tessera.counts.statics === 9', undefined, WAIT);
  const crates = (await shown.evaluate(`(() => {
    const { session, view } = tessera;
    const slots = [...session.bodies.order.subarray(0, session.bodies.count)].filter((slot) => session.bodies.shape[slot] === ${CRATE});
    return { count: slots.length, geometries: new Set(slots.map((slot) => view.batches.geometryOf(slot).uuid)).size, corners: view.batches.geometryOf(slots[0]).index?.count ?? 0 };
  })()`)) as { count: number; geometries: number; corners: number };
  assert.ok(crates.count > 100, `${crates.count} crates`);
  assert.deepEqual([crates.geometries, crates.corners], [1, 18], 'all are instances of one pyramid');
  // From above, the ramp's pyramid is green, and where a pile of crates is there is red in it.
  await shown.evaluate('tessera.view.rig.set([24, 30, 6.01], [24, 1.4, 6])');
  const colour = await pixelAt(shown, [22, 2, 7]);
  assert.ok(colour[1] > 1.5 * colour[0] && colour[1] > 1.5 * colour[2], `green: ${colour.join()}`);
  if (process.env['TESSERA_SHOT']) {
    await shown.evaluate('tessera.view.rig.set([26, 9, 30], [30, 1, 12])');
    await shown.screenshot({ path: process.env['TESSERA_SHOT'] });
  }
  assert.deepEqual(await messagesOf(shown, 'bad'), []);
  assert.deepEqual(heard, { errors: [], foreign: [] });
  await close();
});

test('meshes are painted with the pictures of their file, and with the colours of their vertices', async () => {
  const blueAndYellow = makePng(2, 1, (x) => (x === 0 ? [20, 20, 240] : [240, 240, 20]));
  const flat = { positions: [-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1], indices: [0, 1, 2, 0, 2, 3], places: [0, 0, 0, 1, 1, 1, 1, 0] };
  const red = { ...flat, colours: Array.from({ length: 4 }, () => [1, 0.02, 0.02]).flat() };
  const glb = makeGlb([red, { ...flat, picture: blueAndYellow }]);
  const { shown, heard, close } = await openWithVisuals(withVisuals(new Map([[sha256Of(glb), glb]]), sha256Of(glb)));
  await shown.waitForFunction('tessera.counts.visuals === 2 && tessera.counts.statics === 9', undefined, WAIT);
  await shown.evaluate('tessera.view.rig.set([24, 30, 6.01], [24, 1.4, 6])');
  // The picture is on the ramp, from west to east.
  const west = await pixelAt(shown, [20, 0.6, 7]);
  const east = await pixelAt(shown, [28, 2.2, 7]);
  assert.ok(west[2] > 1.5 * west[0] && west[2] > 1.5 * west[1], `blue: ${west.join()}`);
  assert.ok(east[0] > 1.5 * east[2] && east[1] > 1.5 * east[2], `yellow: ${east.join()}`);
  if (process.env['TESSERA_SHOT']) {
    await shown.evaluate('tessera.view.rig.set([26, 9, 30], [28, 1, 10])');
    await shown.screenshot({ path: process.env['TESSERA_SHOT'] });
  }
  assert.deepEqual(await messagesOf(shown, 'bad'), []);
  assert.deepEqual(heard, { errors: [], foreign: [] });
  await close();
});

test('a picture that is damaged leaves the base colour, and the page says so once', async () => {
  const cut = makePng(64, 64, (x, y) => [x, y, (x * y) & 255]).subarray(0, 60);
  const flat = { positions: [-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1], indices: [0, 1, 2, 0, 2, 3], places: [0, 0, 0, 1, 1, 1, 1, 0], colour: [0.02, 0.9, 0.02], picture: cut };
  const glb = makeGlb([flat, flat]);
  const { shown, heard, close } = await openWithVisuals(withVisuals(new Map([[sha256Of(glb), glb]]), sha256Of(glb)));
  await shown.waitForFunction('tessera.counts.visuals === 2 && tessera.counts.statics === 9', undefined, WAIT);
  assert.match((await messagesOf(shown, 'bad'))[0]!, /A picture of [0-9a-f]{12}….glb cannot be drawn: it is damaged/);
  await shown.evaluate('tessera.view.rig.set([24, 30, 6.01], [24, 1.4, 6])');
  const colour = await pixelAt(shown, [22, 1, 7]);
  assert.ok(colour[1] > 1.5 * colour[0] && colour[1] > 1.5 * colour[2], `green: ${colour.join()}`);
  assert.deepEqual(heard.foreign, []);
  await close();
});

test('a mesh file that is missing, damaged or another one leaves the shapes, and the page says so once', async () => {
  const glb = makeGlb([pyramid(2), pyramid(1)]);
  const cut = glb.subarray(0, 100);
  for (const [files, sha256, why] of [
    [new Map<string, Buffer>(), sha256Of(glb), /--visuals has no file/],
    [new Map([[sha256Of(cut), cut]]), sha256Of(cut), /it is cut short/],
    [new Map([[sha256Of(glb), cut]]), sha256Of(glb), /what came has another hash/],
  ] as const) {
    const { shown, heard, close } = await openWithVisuals(withVisuals(files, sha256));
    await shows(shown, 'bad', why);
    await shown.waitForFunction('tessera.counts.statics === 9', undefined, WAIT);
    assert.equal((await messagesOf(shown, 'bad')).length, 1, 'said once');
    assert.equal(await shown.evaluate('tessera.counts.visuals'), 0);
    assert.equal(await shown.evaluate(`tessera.view.batches.geometryOf(tessera.session.bodies.find('1000000')).type`), 'BoxGeometry');
    assert.deepEqual(heard.foreign, []);
    await close();
  }
});
