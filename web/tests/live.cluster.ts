// The page in a browser, against a real cluster of this build: TESSERA_BIN names its programs.

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { type Complaints, SMALL, WAIT, holds as holdsOn, launch, open } from '../testing/browser.ts';
import { LocalCluster } from '../testing/local_cluster.ts';

const WORLD = 'inst-1';

let browser: Browser;
let cluster: LocalCluster;
let page: Page;
let complaints: Complaints;

before(async () => {
  cluster = await LocalCluster.start(process.env['TESSERA_BIN'] ?? '../build/dev/bin');
  // A lift, a ferry over the border, a turntable and a door: they move for ever, and nobody has to push.
  await cluster.tessera('instance', 'create', '--scene', 'platforms', '--regions', '2', '--wait');
  browser = await launch();
  ({ page, complaints } = await open(browser, cluster.page, { size: SMALL }));
});

after(async () => {
  await browser?.close();
  await cluster?.stop();
});

function holds(expression: string, of = page): Promise<void> {
  return holdsOn(of, expression, WAIT.timeout);
}

// Until bodies that the region owns have gone somewhere, as the page draws them.
async function moves(of: Page): Promise<void> {
  await of.evaluate('globalThis.then = tessera.session.bodies.shown.slice()');
  await holds('tessera.session.bodies.shown.some((part, at) => at % 8 < 3 && Math.abs(part - (globalThis.then[at] ?? part)) > 0.3)', of);
}

// All of the scene is drawn: both regions with their eight moving bodies, and what never moves.
const whole = (of: Page) =>
  holds(
    `tessera.counts.link === 'open' && tessera.counts.dead.length === 0 && tessera.session.room.status?.state === 'RUNNING' &&
     tessera.counts.regions === 2 && tessera.counts.bodies === 8 && tessera.counts.drawn === 8 && tessera.counts.statics === 2`,
    of,
  );

test('the address that was printed leads to the world, which moves', async () => {
  assert.match(cluster.page, /^http:\/\/127\.0\.0\.1:\d+\/#key=[0-9a-f]{64}$/);
  await page.locator('a.card', { hasText: WORLD }).click(WAIT);
  await whole(page);
  assert.equal(new URL(page.url()).hash, `#${WORLD}`, 'nobody copies the key with the address');
  await moves(page);
  // Not blank: sky, ground and bodies in their colours.
  const colours = await page.evaluate(`(() => {
    tessera.page.picture();
    const canvas = document.getElementById('world');
    const gl = canvas.getContext('webgl2');
    const out = new Uint8Array(4 * canvas.width * canvas.height);
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, out);
    return new Set(new Uint32Array(out.buffer)).size;
  })()`);
  assert.ok((colours as number) > 100, `${String(colours)} colours`);
});

test('a body that crosses the border has another owner on the page', async () => {
  const before_ = await page.evaluate('tessera.counts.owner_changes');
  await holds(`tessera.counts.owner_changes > ${String(before_)}`);
});

test('who has the key pauses the world and lets it go on; a page without it is told what to do', async () => {
  const stranger = await open(browser, `${new URL(cluster.page).origin}/#${WORLD}`, { size: SMALL });
  await whole(stranger.page);
  await stranger.page.getByRole('button', { name: 'Pause' }).click();
  await stranger.page.locator('#toasts .bad', { hasText: 'the whole address that `tessera up`' }).waitFor(WAIT);
  await page.getByRole('button', { name: 'Pause' }).click();
  await page.locator('#toasts .ok', { hasText: 'pause' }).waitFor(WAIT);
  await holds('tessera.session.paused');
  await holds('tessera.session.paused', stranger.page);
  const tick = (await page.evaluate('tessera.session.tick')) as number;
  await page.getByTitle('One step forward').click();
  await holds(`tessera.session.paused && tessera.session.tick === ${tick + 1}`);
  await page.getByLabel('Ticks a step').fill('30');
  await page.getByTitle('One step forward').click();
  await holds(`tessera.session.paused && tessera.session.tick === ${tick + 31}`);
  await holds(`tessera.session.paused && tessera.session.tick === ${tick + 31}`, stranger.page);
  await page.getByRole('button', { name: 'Go on' }).click();
  await holds('!tessera.session.paused');
  await moves(page);
  assert.deepEqual(stranger.complaints, { errors: [], foreign: [] });
  await stranger.page.context().close();
});

test('a killed worker is seen to die and to be replaced, and its bodies move', async () => {
  await holds('tessera.session.room.status.unprotected.length === 0');
  await page.getByRole('button', { name: 'End worker 2' }).click();
  await page.locator('#toasts .ok', { hasText: 'is killed' }).waitFor(WAIT);
  await holds('tessera.session.room.status.failovers === 1');
  await whole(page);
  await page.locator('.events li', { hasText: 'region 2' }).first().waitFor(WAIT);
  await moves(page);
});

test('a second gateway shows the same world, and its end is said and harms nobody', async () => {
  const second = await open(browser, await cluster.gateway(), { size: SMALL });
  await second.page.locator('a.card', { hasText: WORLD }).click(WAIT);
  await whole(second.page);
  assert.deepEqual(second.complaints, { errors: [], foreign: [] });
  await moves(second.page);
  await cluster.endGateway();
  await second.page.locator('#banner', { hasText: 'connection' }).waitFor(WAIT);
  await second.page.context().close();
  await moves(page);
});

test('a world that is deleted while it is watched says so', async () => {
  await cluster.tessera('instance', 'delete', WORLD);
  await page.locator('#banner', { hasText: `Instance ${WORLD} has ended` }).waitFor(WAIT);
});

test('a score and a match clock are on the page, and in its recording as they were', async () => {
  await cluster.tessera('instance', 'create', '--scene', '../games/arena/scene.json', '--game', '../games/arena/game.lua', '--wait');
  const arena = await open(browser, `${cluster.page}&inst-2`, { size: SMALL });
  const value = (name: string) => arena.page.locator('#board div', { has: arena.page.locator('dt', { hasText: new RegExp(`^${name}$`) }) }).locator('dd');
  const shows = (text: string) => value('red').filter({ hasText: new RegExp(`^${text}$`) }).waitFor(WAIT);
  const score = (red: number) => cluster.tessera('instance', 'set-property', 'inst-2', 'world', 'red', String(red));
  await score(3);
  await shows('3');
  assert.match(await value('seconds left').innerText(), /^[0-9]+:[0-9]{2}$/);
  await arena.page.getByRole('button', { name: 'Record' }).click();
  await arena.page.getByRole('button', { name: 'Stop recording' }).waitFor(WAIT);
  await score(4);
  await shows('4');
  const clock = await value('seconds left').innerText();
  await value('seconds left').filter({ hasNotText: clock }).waitFor(WAIT);
  await arena.page.getByRole('button', { name: 'Stop recording' }).click();
  await arena.page.locator('#time a[href^="#play/"]').click(WAIT);
  await holds('tessera.session.play !== null', arena.page);
  await arena.page.getByRole('button', { name: 'Pause' }).click();
  const slider = arena.page.getByLabel('Place in the recording');
  await slider.fill('0');
  await shows('3');
  await slider.fill(String(Math.floor(Number(await slider.getAttribute('max')) * 100) / 100));  // its last whole step, as it writes it
  await shows('4');
  await slider.fill('0');
  await shows('3');
  assert.deepEqual(arena.complaints, { errors: [], foreign: [] });
  await arena.page.context().close();
});

test('a visitor plays by a ticket where no guests are taken, and by the same one nobody else does', async () => {
  const made = await cluster.tessera('instance', 'create', '--scene', 'course', '--regions', '1', '--guests', 'off', '--wait');
  const id = /inst-[0-9]+/.exec(made)![0];
  const key = join(cluster.folder, 'game.key');
  await cluster.tessera('issuer', 'create', 'game', '--key-out', key);
  const ticket = (await cluster.tessera('ticket', 'sign', '--key', key, '--player', 'ada@example', '--name', 'Ada')).trim();
  const origin = new URL(cluster.page).origin;
  const ada = await open(browser, `${origin}/#ticket=${ticket}&${id}`, { size: SMALL });
  await holds('tessera.view.own >= 0', ada.page);
  assert.equal(ada.page.url(), `${origin}/#${id}`);
  const other = await open(browser, `${origin}/#${id}`, { size: SMALL });
  await other.page.getByRole('button', { name: 'Play', exact: true }).click(WAIT);
  await other.page.locator('#ticket[open] p', { hasText: 'a ticket is needed' }).waitFor(WAIT);
  await other.page.getByLabel('Ticket').last().fill(ticket);
  await other.page.locator('#ticket').getByRole('button', { name: 'Play' }).click();
  await other.page.locator('#ticket[open] p', { hasText: /[Tt]icket: /, hasNotText: 'is needed' }).waitFor(WAIT);
  for (const { page, complaints } of [ada, other]) {
    assert.deepEqual(complaints, { errors: [], foreign: [] });
    await page.context().close();
  }
  await cluster.tessera('instance', 'delete', id);
});

test('a level that was imported is drawn by its own meshes', async () => {
  const scene = join(cluster.folder, 'harbour.json'); // its meshes go to the gateway through the control plane
  await cluster.tessera('scene', 'import', '../tests/fuzz/seeds/gltf_fuzz/harbour.glb', scene);
  const made = await cluster.tessera('instance', 'create', '--scene', scene, '--regions', '2', '--wait');
  const id = /inst-[0-9]+/.exec(made)![0];
  const harbour = await open(browser, `${new URL(cluster.page).origin}/#${id}`, { size: SMALL });
  await holds('tessera.counts.visuals === 2 && tessera.counts.statics === 2 && tessera.counts.bodies === 7', harbour.page);
  const meshes = await harbour.page.evaluate(`tessera.view.level.group.children.filter((mesh) => mesh.geometry.hasAttribute('color')).length`);
  assert.ok((meshes as number) > 0, 'the quay and the ramp have their own colours');
  if (process.env['TESSERA_SHOT']) await harbour.page.screenshot({ path: process.env['TESSERA_SHOT'] });
  assert.deepEqual(harbour.complaints, { errors: [], foreign: [] });
  await harbour.page.context().close();
});

test('the page asked nobody else and complained of nothing', () => {
  assert.deepEqual(complaints, { errors: [], foreign: [] });
});
