// The page's buttons for operators, pressed in a browser, against a real cluster of two hosts: TESSERA_BIN names its
// programs. Pauses, steps, recordings and the end of a worker are in live.cluster.ts.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { type Complaints, SMALL, WAIT, holds as holdsOn, launch, open } from '../testing/browser.ts';
import { LocalCluster } from '../testing/local_cluster.ts';

const BODIES = 100;
const PATIENCE_MS = 3 * WAIT.timeout; // moving a region takes some seconds

let browser: Browser;
let cluster: LocalCluster;
let page: Page;
let complaints: Complaints;

before(async () => {
  cluster = await LocalCluster.start(process.env['TESSERA_BIN'] ?? '../build/dev/bin', 2);
  // Without checkpoints of its own, so that the newest is the one that is ordered here.
  const made = await cluster.tessera('instance', 'create', '--scene', 'plaza', '--bodies', String(BODIES), '--regions', '2', '--checkpoint-interval', '0', '--wait');
  browser = await launch();
  ({ page, complaints } = await open(browser, `${cluster.page}&${/inst-[0-9]+/.exec(made)![0]}`, { size: SMALL }));
  await settled(2);
});

after(async () => {
  await browser?.close();
  await cluster?.stop();
});

function holds(expression: string): Promise<void> {
  return holdsOn(page, expression, PATIENCE_MS);
}

// So many regions run, nothing is being changed, and all bodies are drawn.
function settled(regions: number): Promise<void> {
  return holds(
    `tessera.counts.link === 'open' && tessera.counts.drawn > ${BODIES} && tessera.counts.dead.length === 0 && tessera.counts.regions === ${regions} &&
     tessera.session.room.status?.state === 'RUNNING' && tessera.session.room.status.regions.length === ${regions} &&
     tessera.session.room.status.changes.length === 0 && tessera.session.room.status.unprotected.length === 0`,
  );
}

// The answer to an order, as the page shows it; those before it are forgotten.
async function answerTo(press: () => Promise<unknown>): Promise<{ kind: string; text: string }> {
  await page.evaluate('messages.length = 0');
  await press();
  await holds('messages.length > 0');
  return (await page.evaluate('messages[0]')) as { kind: string; text: string };
}

const button = (name: string) => page.getByRole('group', { name: 'Orders' }).getByRole('button', { name });

test('a property is set: as text, as the scene declares it', async () => {
  const id = String(await page.evaluate(`(() => {
    const { bodies } = tessera.session;
    return bodies.id(bodies.order.slice(0, bodies.count).find((slot) => bodies.mass[slot] > 0));
  })()`));
  await page.getByLabel('Find a body by id or name').fill(id);
  await page.getByLabel('Find a body by id or name').press('Enter');
  const set = async (value: string) => {
    await page.getByLabel('Property to set').fill('health');
    await page.getByLabel('Its value').fill(value);
    return answerTo(() => page.locator('#detail').getByRole('button', { name: 'Set' }).click());
  };
  assert.deepEqual(await set('many'), { kind: 'bad', text: 'set_property: value: must be a whole number' });
  assert.deepEqual(await set('80'), { kind: 'ok', text: 'set_property: health is set' });
  await page.locator('#detail .properties dd', { hasText: /^80$/ }).waitFor(WAIT);
  await page.getByRole('button', { name: 'Close' }).click();
});

test('the pace is set, and the world keeps it', async () => {
  const choose = (share: string) => answerTo(() => page.getByLabel('Pace', { exact: true }).selectOption(share));
  assert.deepEqual(await choose('0.5'), { kind: 'ok', text: 'pace: goes at 30 ticks a second' });
  await holds(`tessera.session.room.status.ticks_per_second === 30 && tessera.session.room.status.regions.every((region) => region.tick_rate_hz > 1 && region.tick_rate_hz < 40)`);
  assert.equal(await page.getByLabel('Pace', { exact: true }).inputValue(), '0.5');
  assert.deepEqual(await choose('1'), { kind: 'ok', text: 'pace: goes at 60 ticks a second' });
  await holds('tessera.session.room.status.ticks_per_second === 60');
  // Somebody else's choice is shown as well.
  await cluster.tessera('instance', 'pace', await instance(), '--ticks-per-second', '20', '--wait');
  await holds(`document.querySelector('[aria-label=Pace]').value === '0.333'`);
  await cluster.tessera('instance', 'pace', await instance(), '--ticks-per-second', '60', '--wait');
  await holds(`document.querySelector('[aria-label=Pace]').value === '1'`);
});

test('the world is scaled, and back', async () => {
  for (const regions of [3, 2]) {
    await page.getByLabel('Number of regions').fill(String(regions));
    assert.deepEqual(await answerTo(() => button('Scale').click()), { kind: 'ok', text: `scale: scales to ${regions} regions` });
    await settled(regions);
    // The table is written once a second.
    await holds(`document.querySelectorAll('#room tbody tr').length === ${regions}`);
  }
});

test('the world goes back to its checkpoint', async () => {
  const made = await answerTo(() => button('Checkpoint').click());
  const tick = Number(/^checkpoint: checkpoint of tick ([0-9]+)$/.exec(made.text)?.[1]);
  assert.ok(tick > 0, made.text);
  await holds(`tessera.session.tick > ${tick + 120}`);
  // The lowest tick of the frames from now on.
  const reached = Number(await page.evaluate(`(() => {
    const framed = tessera.page.framed.bind(tessera.page);
    window.lowest = Infinity;
    tessera.page.framed = (frame) => {
      lowest = Math.min(lowest, frame.tick);
      framed(frame);
    };
    return tessera.session.tick;
  })()`));
  assert.deepEqual(await answerTo(() => button('Restore').click()), { kind: 'ok', text: `restore: goes on from tick ${tick}` });
  await holds(`lowest < ${reached}`);
  await settled(2);
  await page.locator('.events li', { hasText: `restored from the checkpoint of tick ${tick}` }).waitFor(WAIT);
});

test('a host is drained, and one that is not there is not', async () => {
  const drain = async (host: string) => {
    await page.getByLabel('Host to drain').fill(host);
    return answerTo(() => button('Drain').click());
  };
  const nowhere = await drain('nowhere');
  assert.equal(nowhere.kind, 'bad');
  assert.match(nowhere.text, /^drain: .*nowhere/);
  const from = String(await page.evaluate('tessera.session.room.status.regions[0].host'));
  const to = from === 'local-1' ? 'local-2' : 'local-1';
  assert.deepEqual(await drain(from), { kind: 'ok', text: `drain: drains ${from}` });
  await holds(`tessera.session.room.status.regions.every(({ host }) => host === '${to}')`);
  await settled(2);
  await holds(`[...document.querySelectorAll('#room tbody tr')].every(({ innerText }) => innerText.includes('${to}'))`);
});

test('the page asked nobody else and complained of nothing', () => {
  assert.deepEqual(complaints, { errors: [], foreign: [] });
});

async function instance(): Promise<string> {
  return String(await page.evaluate('tessera.session.welcome.instance'));
}
