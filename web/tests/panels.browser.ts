// The page's panels in a browser, against fake gateways: figures, charts, names, keys, details and the time bar.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { SMALL, WAIT, launch, messagesOf, open, shows } from '../testing/browser.ts';
import { FakeGateway } from '../testing/fake_gateway.ts';

let browser: Browser;

before(async () => {
  browser = await launch();
});

after(async () => {
  await browser?.close();
});

// A page of its own at a small world that does not step.
async function apart(run: (shown: Page, fake: FakeGateway, at: string) => Promise<void>, options: { token?: string } = {}): Promise<void> {
  const fake = new FakeGateway({ page: process.env['TESSERA_PAGE'] ?? 'dist', bodies: 10, still: true, ...options });
  const at = await fake.listen();
  const shown = await open(browser, `${at}/#plaza-1`, { size: SMALL });
  try {
    await holds(shown.page, 'tessera.counts.link === "open" && tessera.counts.drawn > 0 && tessera.session.room.status');
    await run(shown.page, fake, at);
    assert.deepEqual(shown.complaints, { errors: [], foreign: [] });
  } finally {
    await shown.page.context().close();
    await fake.close();
  }
}

function holds(page: Page, expression: string): Promise<unknown> {
  return page.waitForFunction(`window.tessera && (${expression})`, undefined, WAIT);
}

test('the table of regions points out what is wrong with them', async () => {
  await apart(async (shown, fake) => {
    type Region = Record<string, unknown>;
    const [first, second, third, fourth] = (await shown.evaluate('tessera.session.room.status.regions')) as [Region, Region, Region, Region];
    fake.report({
      regions: [{ ...first, step_p99_ms: 17 }, second, { ...third, standby: 0 }, { ...fourth, alive: false, broadcast_ms: undefined, prediction_ms: undefined }],
      unprotected: [2],
      lost_bodies: 1234,
      failovers: 2,
      changes: ['scaling from 4 to 5'],
    });
    await shown.locator('#room .summary', { hasText: '1,234 bodies lost' }).waitFor(WAIT);
    assert.match(await shown.locator('#room .summary').innerText(), /2 failovers/);
    assert.deepEqual(await shown.locator('#room .changes li').allInnerTexts(), ['scaling from 4 to 5']);
    const cell = (row: number, column: number) => shown.locator(`#room tbody tr:nth-child(${row}) td:nth-child(${column})`);
    const warns = async (row: number, column: number) => (await cell(row, column).evaluate((td) => td.outerHTML)).includes('class="warn"');
    assert.deepEqual([await warns(1, 4), await warns(2, 4)], [true, false], 'a step that takes longer than a tick');
    assert.deepEqual([await warns(1, 2), await warns(2, 2)], [false, true], 'a standby that has nothing yet');
    assert.match(await cell(3, 2).innerText(), /no standby/);
    assert.deepEqual([await cell(4, 3).innerText(), (await cell(4, 5).innerText()).trim()], ['lost', '– –']);
    assert.deepEqual(await shown.locator('#room tr.dead').count(), 1);
    // A button keeps the focus while the figures of its row change.
    const end = shown.getByRole('button', { name: 'End worker 2' });
    await end.focus();
    fake.report({ regions: [first, { ...second, bodies: 98765 }, third, fourth] });
    await cell(2, 6).filter({ hasText: '98,765' }).waitFor(WAIT);
    assert.equal(await end.evaluate((button) => document.activeElement === button), true);
    assert.equal(await shown.locator('#room tr.dead').count(), 0);
    fake.report({ regions: [first, third, fourth] });
    await holds(shown, 'document.querySelectorAll("#room tbody tr").length === 3');
    fake.report({ regions: [first, second, third, fourth] });
    await holds(shown, '[...document.querySelectorAll("#room tbody .region")].map((button) => button.textContent).join() === "1,2,3,4"');
    // The button of a region shows its ground.
    await cell(4, 1).getByRole('button').click();
    await holds(shown, 'tessera.view.rig.target[0] > 20 && tessera.view.rig.target[2] > 20');
  });
});

test('charts have a line for each region, which ends where it is dead', async () => {
  await apart(async (shown, fake) => {
    const charts = '[...document.querySelectorAll("#room .charts canvas")].length === 3 && tessera.page.room.charts.plots';
    await holds(shown, `${charts}.every((plot) => plot.series.length === 5 && plot.data[0].length > 1)`);
    assert.equal(fake.kill(4), '');
    await holds(shown, `${charts}.every(({ data }) => data[4].at(-1) === null && data[4][0] !== null && data[3].at(-1) !== null)`);
    const [first, last] = (await shown.evaluate('(({ data }) => [data[0][0], data[0].at(-1)])(tessera.page.room.charts.plots[0])')) as [number, number];
    assert.ok(first < last && last > -5 && last <= 0.5, `seconds before now: ${first} to ${last}`);
  });
});

test('a player’s name stands above the body, and not where that is behind the camera', async () => {
  await apart(async (shown, fake) => {
    fake.world.join('eve');
    const label = shown.locator('#labels span', { hasText: /^eve$/ });
    await label.waitFor(WAIT);
    const [x, y, z] = [...fake.world.players.values()][0]!.body.position as [number, number, number];
    const look = (beyond: number) => shown.evaluate(`tessera.view.rig.set([${x}, ${y + 2}, ${z + 10}], [${x}, ${y}, ${z + 10 + beyond}])`);
    await look(-10);
    await label.waitFor(WAIT);
    const place = (await shown.evaluate(`(tessera.page.picture(), tessera.view.project(${x}, ${y}, ${z}))`)) as { x: number; y: number };
    const box = (await label.boundingBox())!;
    const world = (await shown.locator('#world').boundingBox())!;
    assert.ok(Math.abs(box.x + box.width / 2 - world.x - place.x) < 20 && box.y + box.height < world.y + place.y, `${JSON.stringify(box)} above ${JSON.stringify(place)}`);
    await look(10);
    await label.waitFor({ state: 'hidden', ...WAIT });
    fake.world.leave([...fake.world.players.keys()][0]!);
    await look(-10);
    await holds(shown, 'tessera.session.room.status.player_list.length === 0 && tessera.session.bodies.findName("eve") < 0');
    await label.waitFor({ state: 'hidden', ...WAIT });
  });
});

test('keys do what the buttons do, but not while somebody types', async () => {
  await apart(async (shown, fake) => {
    const mode = shown.getByLabel('Colour bodies by');
    await shown.locator('#world').focus();
    await shown.keyboard.press('c');
    assert.equal(await mode.inputValue(), 'speed');
    await shown.locator('#legend', { hasText: '12 m/s' }).waitFor(WAIT);
    await shown.keyboard.press('r');
    await shown.getByRole('button', { name: 'Stop recording' }).waitFor(WAIT);
    await shown.locator('#time .note', { hasText: 'plaza-1-20260101T000000.rec, 1 kB' }).waitFor(WAIT);
    await shown.keyboard.press('p');
    await holds(shown, 'tessera.session.paused');
    await shown.keyboard.press('Slash');
    await shown.keyboard.type('crate-1000005');
    await shown.keyboard.press('Enter');
    await holds(shown, 'tessera.view.selected >= 0 && tessera.view.follows');
    await shown.keyboard.type('cpr');
    assert.deepEqual([await mode.inputValue(), fake.world.orders.length], ['speed', 2], 'they went into the field');
    await shown.keyboard.press('Escape');
    assert.equal(await shown.evaluate('document.activeElement.tagName'), 'BODY');
    await shown.keyboard.press('f');
    assert.equal(await shown.evaluate('tessera.view.follows'), false);
    await shown.keyboard.press('f');
    assert.equal(await shown.evaluate('tessera.view.follows'), true);
    await holds(shown, 'tessera.view.rig.distance < 30'); // with the next picture
    await shown.keyboard.press('Control+c');
    assert.equal(await mode.inputValue(), 'speed');
    await shown.keyboard.press('Escape');
    await holds(shown, 'tessera.view.selected < 0');
    assert.ok(Number(await shown.evaluate('tessera.view.rig.distance')) < 30, 'near to who was followed');
    await shown.keyboard.press('h');
    await holds(shown, 'tessera.view.rig.distance > 60');
  });
});

test('a search that finds nothing says so until another one is typed, and what is chosen to be drawn is', async () => {
  await apart(async (shown) => {
    const search = shown.getByLabel('Find a body by id or name');
    await search.fill('nobody');
    await search.press('Enter');
    assert.equal(await search.getAttribute('aria-invalid'), 'true');
    await search.press('Backspace');
    assert.equal(await search.getAttribute('aria-invalid'), null);
    const borders = 'tessera.view.territory.curtains.visible';
    assert.equal(await shown.evaluate(borders), true);
    await shown.getByRole('button', { name: 'Borders' }).click();
    assert.equal(await shown.evaluate(borders), false);
    await shown.getByRole('button', { name: 'Shadows' }).click();
    assert.equal(await shown.evaluate('tessera.view.renderer.shadowMap.enabled'), true);
    await shown.reload();
    await holds(shown, 'tessera.view.renderer.shadowMap.enabled'); // the browser keeps it
    await shown.getByRole('button', { name: 'Shadows' }).click();
  });
});

test('a property is set as a number, a truth, a list or a text, as it is typed', async () => {
  await apart(async (shown, fake) => {
    await shown.getByLabel('Find a body by id or name').fill('1000005');
    await shown.getByLabel('Find a body by id or name').press('Enter');
    const values: [string, unknown][] = [['80', 80], ['true', true], ['[1, 2.5, 0]', [1, 2.5, 0]], ['red', 'red'], ['"7"', '7'], ['', '']];
    for (const [typed] of values) {
      await shown.getByLabel('Property to set').fill('health');
      await shown.getByLabel('Its value').fill(typed);
      await shown.getByLabel('Its value').press('Enter');
    }
    await shown.getByLabel('Property to set').fill('');
    await shown.getByLabel('Its value').press('Enter'); // none is no order
    await holds(shown, `messages.filter(({ kind }) => kind === 'ok').length >= ${values.length}`);
    const orders = fake.world.orders.map(({ order, body, name, value }) => ({ order, body, name, value }));
    assert.deepEqual(orders, values.map(([, value]) => ({ order: 'set_property', body: '1000005', name: 'health', value })));
    fake.world.bodies = fake.world.bodies.filter(({ id }) => id !== 1000005n);
    await shown.locator('#detail dd', { hasText: 'This body is no more.' }).waitFor(WAIT);
    await shown.getByRole('button', { name: 'Close' }).click();
    await shown.locator('#detail').waitFor({ state: 'hidden', ...WAIT });
  });
});

test('the pace of the world is chosen and shown, whoever has set it', async () => {
  await apart(async (shown, fake) => {
    const pace = shown.getByLabel('Pace', { exact: true });
    assert.equal(await pace.inputValue(), '1');
    await pace.selectOption('0.25');
    await shows(shown, 'ok', /^pace: done$/);
    assert.deepEqual([fake.world.orders[0]!['order'], fake.world.pace], ['pace', 15]);
    const is = (share: string) => shown.waitForFunction(`document.querySelector('[aria-label=Pace]').value === '${share}'`, undefined, WAIT);
    await holds(shown, 'tessera.session.room.status.ticks_per_second === 15');
    fake.world.pace = 20;
    await is('0.333');
    assert.equal(await pace.locator('option').count(), 5);
    fake.world.paused = true;
    await holds(shown, 'tessera.session.room.status.ticks_per_second === 0');
    assert.equal(await pace.inputValue(), '0.333', 'a paused world keeps its pace');
    fake.world.paused = false;
    fake.world.pace = 30;
    await is('0.5');
    assert.equal(await pace.locator('option').count(), 4);
  });
});

test('a recording goes at the speed that is chosen, a tick back, and on by a key', async () => {
  await apart(async (shown, _fake, at) => {
    await shown.goto(`${at}/#play/plaza-1.rec`);
    await holds(shown, 'tessera.session.play !== null');
    for (const label of ['Pace', 'Ticks a step']) assert.equal(await shown.getByLabel(label, { exact: true }).isVisible(), false, label);
    assert.equal(await shown.getByRole('button', { name: 'Record' }).isVisible(), false);
    await shown.getByLabel('Speed').selectOption('2');
    await shown.locator('#fresh', { hasText: '2×' }).waitFor(WAIT);
    assert.equal(await shown.evaluate('tessera.session.play.speed'), 2);
    await shown.getByRole('button', { name: 'Pause' }).click();
    await shown.locator('#fresh', { hasText: 'paused' }).waitFor(WAIT);
    await shown.getByLabel('Place in the recording').fill('30');
    await holds(shown, 'tessera.session.play.at_s === 30');
    await shown.locator('#time output', { hasText: '0:30.0 of 1:00.0' }).waitFor(WAIT);
    await shown.getByTitle('One step back').click();
    await holds(shown, 'Math.abs(tessera.session.play.at_s - 30 + 1 / 60) < 0.001');
    await shown.locator('#world').focus();
    await shown.keyboard.press('Period');
    await holds(shown, 'Math.abs(tessera.session.play.at_s - 30) < 0.001');
    await shown.keyboard.press('Comma');
    await holds(shown, 'Math.abs(tessera.session.play.at_s - 30 + 1 / 60) < 0.001');
    await shown.keyboard.press('p');
    await holds(shown, '!tessera.session.play.paused');
  });
});

test('a token that somebody thinks better of is sent to nobody, and is forgotten', async () => {
  await apart(
    async (shown, fake) => {
      await shown.getByRole('button', { name: 'Checkpoint' }).click();
      await shown.locator('#right[open]').waitFor(WAIT);
      await shown.getByLabel('Access token').last().fill('tsa_good');
      await shown.locator('#right').getByRole('button', { name: 'Cancel' }).click();
      assert.equal(await shown.locator('#right[open]').count(), 0);
      await shown.getByRole('button', { name: 'Checkpoint' }).click();
      await shown.locator('#right[open]').waitFor(WAIT);
      assert.equal(await shown.getByLabel('Access token').last().inputValue(), '');
      await shown.keyboard.press('Escape');
      assert.deepEqual([fake.world.orders.length, await messagesOf(shown, 'ok')], [0, []]);
    },
    { token: 'tsa_good' },
  );
});

test('the list of worlds says why it is old, and does not say that no world runs where that is not known', async () => {
  await apart(async (shown, fake, at) => {
    await shown.goto(`${at}/#`);
    const [problem, note] = [shown.locator('#worlds [role=alert]'), shown.locator('#worlds [role=status]')];
    const card = shown.locator('a.card[href="#plaza-1"]');
    await card.waitFor(WAIT);
    assert.equal(await problem.isVisible(), false);
    fake.list_problem = 'control plane at unix:/run/x: connection refused; is it running, and is --control its address?';
    await problem.waitFor(WAIT);
    assert.equal(await problem.innerText(), 'Control plane at unix:/run/x: connection refused; is it running, and is --control its address? This list is the last that came; those that run go on meanwhile. It is asked for again every 2 seconds.');
    assert.equal(await card.isVisible(), true);
    fake.no_worlds = true;
    await problem.filter({ hasText: 'Which worlds there are is not known' }).waitFor(WAIT);
    assert.equal(await note.innerText(), '');
    fake.list_problem = '';
    await problem.waitFor({ state: 'hidden', ...WAIT });
    await note.filter({ hasText: 'No world runs. Start one with' }).waitFor(WAIT);
    fake.no_worlds = false;
    await card.waitFor(WAIT);
    assert.equal(await note.innerText(), '');
  });
});
