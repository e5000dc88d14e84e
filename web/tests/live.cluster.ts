// The page in a browser, against a real cluster of this build: TESSERA_BIN names its programs.

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { type Complaints, SMALL, WAIT, bodyPixel, holds as holdsOn, launch, open, pixelAt } from '../testing/browser.ts';
import { LocalCluster } from '../testing/local_cluster.ts';

const WORLD = 'inst-1';
const CRATE = '10'; // on the ferry, which is everybody's
const BALL = '12';

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

type Colour = [red: number, green: number, blue: number];

// The region in whose colour it is, of the first two: blue and amber; 0: it is grey. Ground is dark and blue by itself.
function regionOf([red, , blue]: Colour): number {
  if (red > 1.1 * blue) return 2;
  return blue > 1.9 * red ? 1 : 0;
}

const spread = (colour: Colour) => Math.max(...colour) - Math.min(...colour);

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

test('a body that is handed over takes the colour of its new region, on the screen too', async () => {
  const owner = `tessera.session.bodies.owner[tessera.session.bodies.find('${CRATE}')]`;
  const first = Number(await page.evaluate(owner));
  for (const region of [3 - first, first]) {
    // It is ferried for ever; a body lights up for a moment when it is handed over.
    await holds(`${owner} === ${region} && tessera.view.flashing === 0`);
    const colour = await bodyPixel(page, CRATE);
    assert.equal(regionOf(colour), region, `the crate in region ${region}: ${colour.join()}`);
  }
  await page.getByRole('button', { name: 'Overview' }).click();
});

test('a body that a player drives is shown as a player’s, to the player and to others', async () => {
  const ada = await open(browser, `${cluster.page}&${WORLD}`, { size: SMALL });
  await whole(ada.page);
  await ada.page.getByLabel('Your name as a player').fill('ada');
  await ada.page.getByRole('button', { name: 'Play', exact: true }).click();
  await holds('tessera.view.own >= 0', ada.page);
  const id = String(await ada.page.evaluate('tessera.session.bodies.id(tessera.view.own)'));
  const slot = `tessera.session.bodies.find('${id}')`;
  await holds(`${slot} >= 0`);
  await page.locator('#labels span', { hasText: /^ada$/ }).waitFor(WAIT);

  const select = async (of: Page) => {
    await of.getByLabel('Find a body by id or name').fill(id);
    await of.getByLabel('Find a body by id or name').press('Enter');
  };
  await select(page);
  await page.locator('#detail h2', { hasText: 'ada' }).waitFor(WAIT);
  await page.locator('#detail dd', { hasText: /, player [0-9]+$/ }).waitFor(WAIT);
  await page.getByRole('button', { name: 'Close' }).click();
  await select(ada.page);
  await ada.page.locator('#detail dd', { hasText: /predicted, player [0-9]+$/ }).waitFor(WAIT); // its own, at once
  await ada.page.getByRole('button', { name: 'Close' }).click();

  await page.getByLabel('Colour bodies by').selectOption('player');
  const [hers, nobodys] = [await bodyPixel(page, id), await bodyPixel(page, BALL)];
  assert.ok(spread(hers) > 60 && spread(nobodys) < 40, `${hers.join()} and ${nobodys.join()}`);
  await page.getByLabel('Colour bodies by').selectOption('region');
  await page.getByRole('button', { name: 'Overview' }).click();

  const at = `8 * ${slot}`;
  const [x, z] = (await page.evaluate(`[0, 2].map((axis) => tessera.session.bodies.shown[${at} + axis])`)) as [number, number];
  await ada.page.locator('#world').focus();
  await ada.page.keyboard.down('d');
  await holds(`Math.hypot(tessera.session.bodies.shown[${at}] - ${x}, tessera.session.bodies.shown[${at} + 2] - ${z}) > 1`);
  await ada.page.keyboard.up('d');
  await ada.page.getByRole('button', { name: 'Leave' }).click();
  await holds(`${slot} < 0`);
  await page.locator('#labels span', { hasText: /^ada$/ }).waitFor({ state: 'hidden', ...WAIT });
  assert.deepEqual(ada.complaints, { errors: [], foreign: [] });
  await ada.page.context().close();
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

// A failover is over before it can be seen, so the control plane, which begins one, is away meanwhile.
test('the area of a region without a worker is grey until it is carried on', async () => {
  await holds('tessera.session.room.status.unprotected.length === 0');
  const failovers = Number(await page.evaluate('tessera.session.room.status.failovers'));
  const place = (await page.evaluate(`(() => {
    const { min_x, max_x, min_z, max_z } = tessera.session.map.cells.find(({ owner }) => owner === 2);
    return [Math.floor((min_x + 3 * max_x) / 4) + 0.5, 0, Math.floor((min_z + 3 * max_z) / 4) + 0.5];
  })()`)) as [number, number, number];
  const [x, , z] = place;
  const ground = async () => {
    await page.evaluate(`tessera.view.follows = false; tessera.view.rig.set([${x}, 25, ${z + 0.01}], [${x}, 0, ${z}])`);
    return pixelAt(page, place);
  };
  const owner = `tessera.session.map.cells.find((cell) => ${x} > cell.min_x && ${x} < cell.max_x && ${z} > cell.min_z && ${z} < cell.max_z).owner`;
  const before = await ground();
  assert.equal(regionOf(before), 2, `the ground of region 2: ${before.join()}`);
  const theirs = (await page.evaluate(`tessera.session.bodies.order.slice(0, tessera.session.bodies.count).find((slot) => tessera.session.bodies.owner[slot] === 2)`)) as number;
  const body = String(await page.evaluate(`tessera.session.bodies.id(${theirs})`));

  await cluster.killControl();
  try {
    await page.getByRole('button', { name: 'End worker 2' }).click();
    await page.locator('#toasts .ok', { hasText: 'is killed' }).last().waitFor(WAIT);
    await holds('tessera.counts.dead.join() === "2"');
    const grey = [await ground(), await bodyPixel(page, body)];
    assert.equal(regionOf(grey[0]!), 0, `ground: ${grey[0]!.join()}`);
    assert.ok(spread(grey[1]!) < 40, `body: ${grey[1]!.join()}`);
    assert.match(await page.locator('tr.dead').innerText(), /^2\s/);
  } finally {
    cluster.restartControl();
  }
  await holds(`tessera.session.room.status.failovers === ${failovers + 1}`);
  await whole(page);
  const after = await ground();
  assert.equal(regionOf(after), Number(await page.evaluate(owner)), `the ground again: ${after.join()}`);
  await holds('document.querySelectorAll("tr.dead").length === 0');
  await moves(page);
  await page.getByRole('button', { name: 'Overview' }).click();
});

test('the list of worlds says that the control plane is away, and the world goes on', async () => {
  const list = await open(browser, `${new URL(cluster.page).origin}/`, { size: SMALL });
  const card = list.page.locator('a.card', { hasText: WORLD });
  const problem = list.page.locator('#worlds [role=alert]');
  await card.waitFor(WAIT);
  assert.equal(await problem.isVisible(), false);
  await cluster.killControl();
  try {
    await problem.filter({ hasText: 'Control plane at ' }).waitFor(WAIT);
    assert.match(await problem.innerText(), /This list is the last that came; those that run go on meanwhile/);
    assert.equal(await card.isVisible(), true);
    await page.locator('#fresh', { hasText: /^figures [0-9]+ s old$/ }).waitFor(WAIT);
    await moves(page);
  } finally {
    cluster.restartControl();
  }
  await problem.waitFor({ state: 'hidden', ...WAIT });
  await page.locator('#fresh', { hasText: /^live$/ }).waitFor(WAIT);
  await whole(page);
  assert.deepEqual(list.complaints, { errors: [], foreign: [] });
  await list.page.context().close();
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
