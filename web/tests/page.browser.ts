// The page in a browser, against the fake gateway.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { type Complaints, SMALL, WAIT, launch, open, pixelAt, settled } from '../testing/browser.ts';
import { ENDED, FakeGateway } from '../testing/fake_gateway.ts';

const BODIES = 300;
const PILES = 420;
const MOST_BYTES = 400_000;

let browser: Browser;
let gateway: FakeGateway;
let address: string;
let page: Page;
let complaints: Complaints;

before(async () => {
  gateway = new FakeGateway({ page: process.env['TESSERA_PAGE'] ?? 'dist', bodies: BODIES, still: true });
  address = await gateway.listen();
  browser = await launch();
  ({ page, complaints } = await open(browser, `${address}/#plaza-1`, { size: SMALL }));
  await settled(page, BODIES);
});

after(async () => {
  await browser?.close();
  await gateway?.close();
});

function value<T>(expression: string): Promise<T> {
  return page.evaluate(expression) as Promise<T>;
}

function steps(count: number): void {
  for (let left = count; left > 0; --left) gateway.world.step();
}

// A body that is put where nothing hides it, and a camera that looks at it from above.
async function stage(x: number, z: number): Promise<{ id: string; place: number[] }> {
  const body = gateway.world.bodies[1]!;
  body.fixed = true;
  body.shape = 1;
  body.position = [x, 6, z];
  body.velocity = [0, 0, 0];
  body.owner = gateway.world.regionAt(body.position);
  await page.waitForFunction(`Math.abs(tessera.session.bodies.shown[8 * tessera.session.bodies.find('${body.id}')] - ${x}) < 0.01`, undefined, WAIT);
  await value(`tessera.view.rig.set([${x}, 16, ${z + 0.01}], [${x}, 6, ${z}])`);
  return { id: String(body.id), place: [x, 6, z] };
}

const ownerIs = (id: string, owner: number) =>
  page.waitForFunction(`tessera.session.bodies.owner[tessera.session.bodies.find('${id}')] === ${owner} && tessera.view.flashing === 0`, undefined, WAIT);

test('as many bodies are drawn as there are, and the picture is not blank', async () => {
  const counts = await value<{ bodies: number; drawn: number; statics: number }>('tessera.counts');
  assert.deepEqual([counts.bodies, counts.drawn, counts.statics], [BODIES + PILES, BODIES + PILES, 9]);
  const colours = await value<number>(`(() => {
    tessera.page.picture();
    const canvas = document.getElementById('world');
    const gl = canvas.getContext('webgl2');
    const out = new Uint8Array(4 * canvas.width * canvas.height);
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, out);
    return new Set(new Uint32Array(out.buffer)).size;
  })()`);
  assert.ok(colours > 500, `${colours} colours`);
});

test('a body that crosses a border takes the colour of its new region', async () => {
  const { id, place } = await stage(-20, -20);
  await ownerIs(id, 1);
  const [red, , blue] = await pixelAt(page, place);
  assert.ok(blue > 1.5 * red, 'region 1 is blue');
  const there = await stage(20, -20);
  await ownerIs(id, 2);
  const after = await pixelAt(page, there.place);
  assert.ok(after[0] > 1.5 * after[2], `region 2 is amber: ${after.join()}`);
});

test('a dead region greys and comes back on its standby’s host', async () => {
  const { place, id } = await stage(20, 30);
  await ownerIs(id, 4);
  assert.equal(gateway.kill(4), '');
  await page.waitForFunction('tessera.counts.dead.includes(4)', undefined, WAIT);
  const grey = await pixelAt(page, place);
  assert.ok(Math.max(...grey) - Math.min(...grey) < 40, `grey: ${grey.join()}`);
  await page.waitForFunction('document.querySelectorAll("tr.dead").length === 1', undefined, WAIT);
  steps(130);
  await page.waitForFunction('tessera.counts.dead.length === 0', undefined, WAIT);
  const [red, green] = await pixelAt(page, place);
  assert.ok(red > 1.3 * green, 'region 4 is pink again');
  await page.locator('#room tbody tr:nth-child(4)', { hasText: 'host-1' }).waitFor(WAIT);
});

test('a click shows a body, and its properties as they come', async () => {
  await stage(-20, -20);
  const box = (await page.locator('#world').boundingBox())!;
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await page.locator('#detail h2').waitFor();
  assert.equal(await page.locator('#detail h2').innerText(), gateway.world.bodies[1]!.name);
  await page.locator('#detail dt:text("health")').waitFor(WAIT);
  await page.keyboard.press('Escape');
  await page.locator('#detail').waitFor({ state: 'hidden' });
});

test('a body is found by name', async () => {
  await page.keyboard.press('Slash');
  await page.keyboard.type('crate-1000005');
  await page.keyboard.press('Enter');
  await page.locator('#detail dd:text-is("1000005")').waitFor(WAIT);
  await page.keyboard.press('Escape');
  await page.keyboard.press('Escape');
});

test('a contact is marked where it is, for a moment, unless it is switched off', async () => {
  const met = (kind: string, point?: number[]) => gateway.say({ type: 'met', kind, body: '101', other: '102', point, impulse: 3 });
  met('contact_ended');
  met('contact_began', [-20, 6, -20]);
  await page.waitForFunction('tessera.counts.contacts === 1', undefined, WAIT);
  await page.waitForFunction('tessera.counts.contacts === 0', undefined, WAIT);
  met('trigger_entered'); // where its body is
  await page.waitForFunction('tessera.counts.contacts === 1', undefined, WAIT);
  await page.waitForFunction('tessera.counts.contacts === 0', undefined, WAIT);
  await page.getByRole('button', { name: 'Contacts' }).click();
  met('contact_began', [0, 0, 0]);
  await page.waitForFunction('tessera.session.met === 4', undefined, WAIT);
  assert.equal(await value<number>('tessera.counts.contacts'), 0);
  await page.getByRole('button', { name: 'Contacts' }).click();
});

test('a correction of the prediction is shown with its cause, for a while', async () => {
  gateway.say({ type: 'corrected', body: '101', text: '0.12 m: it met body 9' });
  const shows = (text: string) => page.waitForFunction(`document.getElementById('correction').textContent === '${text}'`, undefined, WAIT);
  await shows('prediction corrected by 0.12 m: it met body 9');
  await shows('');
});

test('the world’s own properties stand over the picture, as its scene declares them', async () => {
  const board = page.locator('#board');
  assert.equal(await board.isVisible(), false, 'it has none');
  gateway.say({ type: 'world', properties: { red: 3, blue: 1, seconds_left: 95, playing: true, phase: '', home: [1, 2.5, 0] } });
  await board.waitFor(WAIT);
  assert.deepEqual(await board.locator('dt').allInnerTexts(), ['red', 'blue', 'seconds left', 'playing', 'phase', 'home']);
  assert.deepEqual(await board.locator('dd').allInnerTexts(), ['3', '1', '1:35', 'yes', '–', '1, 2.5, 0']);
  const edge = (at: number) => board.locator('div').nth(at).evaluate((tile) => getComputedStyle(tile).borderTopColor);
  assert.deepEqual([await edge(0), await edge(1)], ['rgb(255, 0, 0)', 'rgb(0, 0, 255)']);
  gateway.say({ type: 'world', properties: { red: 4, blue: 1, seconds_left: 9, playing: true, phase: 'play', home: [1, 2.5, 0] } });
  await board.locator('dd', { hasText: '0:09' }).waitFor(WAIT);
  assert.deepEqual((await board.locator('dd').allInnerTexts()).slice(0, 5), ['4', '1', '0:09', 'yes', 'play']);
  const [tools, tiles] = [(await page.locator('#tools').boundingBox())!, (await board.boundingBox())!];
  assert.ok(tools.x + tools.width <= tiles.x || tools.y + tools.height <= tiles.y, 'it covers no tools');
  gateway.say({ type: 'world', properties: {} });
  await board.waitFor({ state: 'hidden', ...WAIT });
});

test('bodies take the colours of a property that the world declares', async () => {
  await page.getByLabel('Colour bodies by').selectOption({ label: 'health' });
  await page.locator('#legend', { hasText: '99' }).waitFor(WAIT);
  const colours = await value<Record<string, number[]>>(`(() => {
    const { session, view } = tessera;
    const of = {};
    for (let place = 0; place < session.bodies.count; ++place) {
      const slot = session.bodies.order[place];
      of[session.bodies.id(slot)] = view.batches.colour(slot);
    }
    return of;
  })()`);
  const with_ = (digits: number) => Object.entries(colours).filter(([id]) => Number(BigInt(id) % 100n) === digits).map(([, colour]) => colour);
  for (const digits of [0, 50, 99]) {
    const same = with_(digits);
    assert.ok(same.length > 1, `${same.length} bodies with ${digits}`);
    for (const colour of same) assert.deepEqual(colour, same[0]);
  }
  const [low, high] = [with_(0)[0]!, with_(99)[0]!];
  assert.ok(low[2]! > 2 * low[0]! && high[0]! > 2 * high[2]!, `from blue ${low.join()} to red ${high.join()}`);
  await page.getByLabel('Colour bodies by').selectOption('region');
  await page.locator('#legend', { hasText: 'region 1' }).waitFor(WAIT);
});

test('the gateway is told what is looked at, and the page says when bytes are scarce', async () => {
  await value('tessera.view.rig.set([10, 30, 20.01], [10, 2, 20])');
  const told = () => Math.hypot(...[10, 2, 20].map((at, axis) => at - (gateway.world.looked_at[axis] ?? Infinity))) < 2;
  for (const until = performance.now() + WAIT.timeout; !told() && performance.now() < until; ) await value('new Promise(requestAnimationFrame)');
  assert.ok(told(), `looked at ${gateway.world.looked_at.join()}`);
  const late = (is: boolean) => page.waitForFunction(`document.getElementById('counts').textContent.includes('some late') === ${is}`, undefined, WAIT);
  gateway.world.limited = true;
  await late(true);
  gateway.world.limited = false;
  await late(false);
});

test('the right stick turns the camera', async () => {
  const yaw = await value<number>('tessera.view.rig.yaw');
  const stick = (right: number) => value(`void (navigator.getGamepads = () => [{ connected: true, axes: [0, 0, ${right}, 0], buttons: [] }])`);
  await stick(1);
  await page.waitForFunction(`tessera.view.rig.yaw < ${yaw} - 0.2`, undefined, WAIT);
  await stick(0);
});

test('a world that goes has no steps, and one that is paused makes as many as are asked for', async () => {
  const step = page.getByTitle('One step forward');
  assert.equal(await step.isVisible(), false);
  await page.getByRole('button', { name: 'Pause' }).click();
  await step.waitFor(WAIT);
  assert.equal(await page.getByTitle('One step back').isVisible(), false);
  const begin = gateway.world.tick;
  const there = (ticks: number) => page.waitForFunction(`tessera.session.tick === ${begin + ticks}`, undefined, WAIT);
  await step.click();
  await there(1);
  await page.getByLabel('Ticks a step').fill('20');
  await page.locator('#world').focus();
  await page.keyboard.press('Period');
  await there(21);
  await page.getByLabel('Ticks a step').fill('0');
  await step.click();
  assert.equal(await page.getByLabel('Ticks a step').evaluate((input) => (input as HTMLInputElement).validity.valid), false);
  assert.equal(gateway.world.tick, begin + 21, 'none is no step');
  await page.getByLabel('Ticks a step').fill('1');
  await page.getByRole('button', { name: 'Go on' }).click();
  await step.waitFor({ state: 'hidden', ...WAIT });
});

test('a player drives, and a second page sees it', async () => {
  const second = await open(browser, `${address}/#plaza-1`, { size: SMALL });
  await page.getByLabel('Your name as a player').fill('ada');
  await page.getByRole('button', { name: 'Play', exact: true }).click();
  await page.waitForFunction('tessera.view.own >= 0', undefined, WAIT);
  const player = [...gateway.world.players.values()][0]!;
  assert.equal(player.name, 'ada');
  const find = `tessera.session.bodies.find('${player.body.id}')`;
  await second.page.waitForFunction(`window.tessera && ${find} >= 0`, undefined, WAIT);
  const begin = [...player.body.position];
  await page.locator('#world').focus();
  await page.keyboard.down('w');
  while (!player.force.some((part) => part !== 0)) await value('new Promise(requestAnimationFrame).then(() => 0)');
  steps(60);
  await second.page.waitForFunction(`Math.hypot(tessera.session.bodies.shown[8 * ${find}] - ${begin[0]}, tessera.session.bodies.shown[8 * ${find} + 2] - ${begin[2]}) > 0.5`, undefined, WAIT);
  await page.keyboard.up('w');
  await page.getByRole('button', { name: 'Leave' }).click();
  await second.page.waitForFunction(`${find} < 0`, undefined, WAIT);
  assert.deepEqual(second.complaints, { errors: [], foreign: [] });
  await second.page.context().close();
});

test('an order’s answer is shown', async () => {
  await page.getByRole('button', { name: 'Checkpoint' }).click();
  await page.locator('#toasts .ok', { hasText: 'checkpoint' }).waitFor(WAIT);
  await page.getByRole('button', { name: 'Scale' }).click();
  await page.locator('#toasts .bad').waitFor(WAIT);
});

test('the page asks nobody else, complains of nothing and is small', () => {
  assert.deepEqual(complaints, { errors: [], foreign: [] });
  // Two pages were served by now.
  assert.ok(gateway.served_bytes / 2 <= MOST_BYTES, `${gateway.served_bytes / 2} bytes`);
});

test('a lost connection is said, and comes back by itself', async () => {
  gateway.refuse = true;
  gateway.dropAll();
  await page.locator('#banner').waitFor(WAIT);
  gateway.refuse = false;
  await page.waitForFunction('tessera.counts.link === "open"', undefined, WAIT);
  await settled(page, BODIES);
  await page.locator('#banner').waitFor({ state: 'hidden' });
});

test('the list of worlds, a world that is not there, and a recording', async () => {
  await page.goto(`${address}/#`);
  await page.locator('a.card', { hasText: 'plaza-1' }).first().waitFor(WAIT);
  await page.goto(`${address}/#nowhere`);
  await page.locator('#banner', { hasText: 'no such instance' }).waitFor(WAIT);
  await page.goto(`${address}/#play/plaza-1.rec`);
  await page.waitForFunction('tessera.session.play', undefined, WAIT);
  await page.getByRole('button', { name: 'Pause' }).click();
  await page.waitForFunction('tessera.session.play.paused', undefined, WAIT);
  assert.equal(await page.getByRole('group', { name: 'Orders' }).isVisible(), false, 'a recording takes no orders');
  await page.getByLabel('Place in the recording').fill('42');
  await page.waitForFunction('Math.abs(tessera.session.play.at_s - 42) < 1', undefined, WAIT);
  await page.locator('#board dd', { hasText: '4' }).waitFor(WAIT);
  await page.getByLabel('Place in the recording').fill('25');
  await page.locator('#board dd', { hasText: '2' }).waitFor(WAIT);
  await page.getByLabel('Place in the recording').fill('42');
  await page.waitForFunction('Math.abs(tessera.session.play.at_s - 42) < 1', undefined, WAIT);
  await page.getByTitle('One step forward').click();
  await page.waitForFunction('Math.abs(tessera.session.play.at_s - 42 - 1 / 60) < 0.005', undefined, WAIT);
});

test('a world that has ended is asked for once, and again when somebody says so', async () => {
  const asked = () => gateway.refused.filter((name) => name === ENDED).length;
  await page.goto(`${address}/#${ENDED}`);
  const banner = page.locator('#banner', { hasText: 'has ended' });
  await banner.waitFor(WAIT);
  assert.match(await banner.innerText(), /Other worlds are in the list/);
  assert.doesNotMatch(await banner.innerText(), /Connecting again/);
  const before = asked();
  // The other one is asked for again by itself, as long as it may come about.
  const other = await open(browser, `${address}/#nowhere`, { size: SMALL });
  const tries = () => gateway.refused.filter((name) => name === 'nowhere').length;
  const first = tries();
  await other.page.waitForFunction('tessera.counts.link === "waiting"', undefined, WAIT);
  while (tries() < first + 2) await other.page.waitForTimeout(50);
  await other.page.close();
  assert.equal(asked(), before, 'no time helps');
  await page.locator('#banner button').click();
  while (asked() === before) await page.waitForTimeout(50);
});

test('a browser without WebGL is told so', async () => {
  const context = await browser.newContext();
  const without = await context.newPage();
  await without.addInitScript(() => {
    HTMLCanvasElement.prototype.getContext = () => null;
  });
  await without.goto(`${address}/#plaza-1`);
  await without.getByText('needs WebGL 2').waitFor(WAIT);
  await without.getByText('tessera instance describe').waitFor(WAIT);
  await context.close();
});
