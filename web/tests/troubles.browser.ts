// The page in a browser, against fake gateways where something is amiss: tickets, rights, worlds and recordings that are
// not as they should be; and its habits.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { SMALL, WAIT, launch, open } from '../testing/browser.ts';
import { DAMAGED, FakeGateway, MISSING } from '../testing/fake_gateway.ts';

let browser: Browser;

before(async () => {
  browser = await launch();
});

after(async () => {
  await browser?.close();
});

// A page of its own at a small world.
async function apart(run: (shown: Page, fake: FakeGateway, at: string) => Promise<void>, options: { dark?: boolean } = {}): Promise<void> {
  const fake = new FakeGateway({ page: process.env['TESSERA_PAGE'] ?? 'dist', bodies: 10, still: true });
  const at = await fake.listen();
  const shown = await open(browser, `${at}/#plaza-1`, { size: SMALL, ...options });
  await shown.page.waitForFunction('window.tessera && tessera.counts.link === "open" && tessera.counts.drawn > 0', undefined, WAIT);
  await run(shown.page, fake, at);
  assert.deepEqual(shown.complaints, { errors: [], foreign: [] });
  await shown.page.context().close();
  await fake.close();
}

test('where no guests are taken the page asks for a ticket, says what is wrong with it, and keeps it nowhere', async () => {
  const strict = new FakeGateway({ page: process.env['TESSERA_PAGE'] ?? 'dist', bodies: 10, still: true, ticket: 'AVZH-good' });
  const at = await strict.listen();
  const { page, complaints } = await open(browser, `${at}/#plaza-1`, { size: SMALL });
  const give = async (ticket: string) => {
    await page.getByLabel('Ticket').last().fill(ticket);
    await page.locator('#ticket').getByRole('button', { name: 'Play' }).click();
  };
  await page.waitForFunction('window.tessera && tessera.counts.link === "open"', undefined, WAIT);
  await page.getByRole('button', { name: 'Play', exact: true }).click();
  await page.locator('#ticket[open] p', { hasText: 'a ticket is needed' }).waitFor(WAIT);
  await give('AVZH-late');
  await page.locator('#ticket[open] p', { hasText: 'ran out 31 s ago' }).waitFor(WAIT);
  assert.equal(await page.evaluate('tessera.counts.link'), 'open', 'it is still watched');
  await give('AVZH-good');
  await page.waitForFunction('tessera.view.own >= 0', undefined, WAIT);
  assert.equal([...strict.world.players.values()][0]!.name, 'ada');
  assert.equal(await page.locator('#ticket[open]').count(), 0);
  const kept = 'JSON.stringify({ ...localStorage, ...sessionStorage }).includes("AVZH") || location.href.includes("AVZH") || document.cookie.includes("AVZH") || document.querySelector("#ticket input").value !== ""';
  assert.equal(await page.evaluate(kept), false);
  assert.deepEqual(complaints, { errors: [], foreign: [] });
  await page.context().close();
  await strict.close();
});

test('a ticket in the address leaves it, is sent to no server by the browser, and joins', async () => {
  const strict = new FakeGateway({ page: process.env['TESSERA_PAGE'] ?? 'dist', bodies: 10, still: true, ticket: 'AVZH-good' });
  const at = await strict.listen();
  const asked: string[] = [];
  const { page, complaints } = await open(browser, `${at}/#ticket=AVZH-good&plaza-1`, {
    size: SMALL,
    before: (fresh) => Promise.resolve(void fresh.on('request', (request) => asked.push(`${request.url()} ${JSON.stringify(request.headers())}`))),
  });
  await page.waitForFunction('window.tessera && tessera.view.own >= 0', undefined, WAIT);
  assert.equal(page.url(), `${at}/#plaza-1`);
  // The browser’s own account of an address has what follows its hash; a server gets it neither in a path nor a header.
  for (const request of asked) assert.doesNotMatch(request.replace(/#[^ ]*/, ''), /AVZH/);
  assert.equal(strict.world.players.size, 1);
  await page.getByRole('button', { name: 'Leave' }).click();
  await page.waitForFunction('tessera.view.own < 0', undefined, WAIT);
  await page.getByRole('button', { name: 'Play', exact: true }).click();
  await page.locator('#ticket[open] p', { hasText: 'a ticket is needed' }).waitFor(WAIT);
  assert.deepEqual(complaints, { errors: [], foreign: [] });
  await page.context().close();
  await strict.close();
});

test('an order asks for a token, which the tab keeps and nothing else', async () => {
  const strict = new FakeGateway({ page: process.env['TESSERA_PAGE'] ?? 'dist', bodies: 10, still: true, token: 'tsa_good' });
  const at = await strict.listen();
  const { page, complaints } = await open(browser, `${at}/#plaza-1`, { size: SMALL });
  const give = async (token: string) => {
    await page.locator('#right[open]').waitFor(WAIT);
    await page.getByLabel('Access token').last().fill(token);
    await page.getByRole('button', { name: 'Use token' }).click();
  };
  await page.waitForFunction('window.tessera && tessera.counts.link === "open"', undefined, WAIT);
  await page.getByRole('button', { name: 'Checkpoint' }).click();
  await give('tsa_bad');
  await page.locator('#right[open] p', { hasText: 'that is no token of this cluster' }).waitFor(WAIT);
  await give('tsa_good');
  await page.locator('#toasts .ok', { hasText: 'checkpoint' }).waitFor(WAIT);
  assert.equal(await page.locator('#right[open]').count(), 0);
  assert.equal(await page.evaluate('JSON.stringify(localStorage).includes("tsa_") || location.href.includes("tsa_") || document.cookie.includes("tsa_")'), false);
  await page.reload();
  await page.waitForFunction('window.tessera && tessera.counts.link === "open"', undefined, WAIT);
  await page.getByRole('button', { name: 'Checkpoint' }).click();
  await page.locator('#toasts .ok', { hasText: 'checkpoint' }).waitFor(WAIT);
  assert.deepEqual(complaints, { errors: [], foreign: [] });
  await page.context().close();
  await strict.close();
});

test('the key of a local cluster leaves the address, and orders are taken by it', async () => {
  const local = new FakeGateway({ page: process.env['TESSERA_PAGE'] ?? 'dist', bodies: 10, still: true, key: 'abc123' });
  const at = await local.listen();
  const { page } = await open(browser, `${at}/#key=abc123&plaza-1`, { size: SMALL });
  await page.waitForFunction('window.tessera && tessera.counts.link === "open"', undefined, WAIT);
  assert.equal(page.url(), `${at}/#plaza-1`);
  await page.getByRole('button', { name: 'Checkpoint' }).click();
  await page.locator('#toasts .ok', { hasText: 'checkpoint' }).waitFor(WAIT);
  await page.context().close();
  const stranger = await open(browser, `${at}/#plaza-1`, { size: SMALL });
  await stranger.page.waitForFunction('window.tessera && tessera.counts.link === "open"', undefined, WAIT);
  await stranger.page.getByRole('button', { name: 'Checkpoint' }).click();
  await stranger.page.locator('#toasts .bad', { hasText: 'needs a key' }).waitFor(WAIT);
  await stranger.page.context().close();
  await local.close();
});

test('a world that fails while it is watched says why and what to do, and is asked for when somebody says so', async () => {
  await apart(async (shown, fake) => {
    fake.fail('failed', 'instance plaza-1 has failed: region 2 was lost with its standby');
    const banner = shown.locator('#banner', { hasText: 'region 2 was lost with its standby' });
    await banner.waitFor(WAIT);
    assert.match(await banner.innerText(), /tessera instance restore/);
    assert.doesNotMatch(await banner.innerText(), /Connecting again/, 'no time helps');
    assert.ok((await shown.evaluate('tessera.counts.drawn')) as number > 0, 'its last moment stays');
    await banner.locator('button').click();
    await shown.waitForFunction('tessera.counts.link === "open"', undefined, WAIT);
    await banner.waitFor({ state: 'hidden', ...WAIT });
  });
});

test('a world that restarts while it is watched is shown as it is then, and nothing of before', async () => {
  await apart(async (shown, fake) => {
    const before = (await shown.evaluate('tessera.counts.bodies')) as number;
    const gone = fake.world.bodies.splice(0, 5).map(({ id }) => String(id));
    fake.restart();
    await shown.waitForFunction(`tessera.counts.bodies === ${before - 5} && tessera.counts.drawn === ${before - 5}`, undefined, WAIT);
    for (const id of gone) assert.equal(await shown.evaluate(`tessera.session.bodies.find('${id}')`), -1);
    assert.equal(await shown.evaluate('tessera.counts.statics'), 9, 'its level stands once');
    assert.equal(await shown.locator('#banner').isVisible(), false, 'the connection was not lost');
  });
});

test('a viewer without a right is told who needs it', async () => {
  await apart(async (shown, fake) => {
    fake.barred = 'token eve is for the instances inst-7 alone';
    fake.fail('not_allowed', fake.barred);
    const banner = shown.locator('#banner', { hasText: 'Token eve is for the instances inst-7 alone' });
    await banner.waitFor(WAIT);
    assert.match(await banner.innerText(), /it is the gateway that needs the right/);
  });
});

test('a message that cannot be read is said, and the picture begins anew', async () => {
  await apart(async (shown, fake) => {
    // The banner stands for half a second: what it says is kept here.
    await shown.evaluate(`(() => {
      const linked = tessera.page.linked.bind(tessera.page);
      window.said = [];
      tessera.page.linked = (link) => {
        linked(link);
        if (link.state === 'waiting') said.push(document.getElementById('banner').textContent);
      };
    })()`);
    for (const bytes of [[], [99], [5, 255, 255], [1, 2]]) {
      const frames = (await shown.evaluate('(said.length = 0, tessera.session.frames)')) as number;
      fake.garble(bytes);
      await shown.waitForFunction("said.some((text) => text.includes('could not be read'))", undefined, WAIT);
      await shown.waitForFunction(`tessera.counts.link === "open" && tessera.session.frames > ${frames + 2} && tessera.counts.drawn > 0`, undefined, WAIT);
    }
  });
});

test('a page whose worker cannot be had says so', async () => {
  const fake = new FakeGateway({ page: process.env['TESSERA_PAGE'] ?? 'dist', bodies: 10, still: true });
  const at = await fake.listen();
  const { page } = await open(browser, `${at}/#plaza-1`, { size: SMALL, before: (fresh) => fresh.context().route('**/assets/feed.js', (route) => route.abort()) });
  await page.locator('#banner', { hasText: 'A part of this page could not be loaded' }).waitFor(WAIT);
  await page.context().close();
  await fake.close();
});

test('a recording that is damaged, or is not there, says so and is not asked for again', async () => {
  await apart(async (shown, _fake, at) => {
    await shown.goto(`${at}/#play/${DAMAGED}`);
    await shown.locator('#banner', { hasText: 'is damaged after 3.5 s' }).waitFor(WAIT);
    assert.match(await shown.locator('#banner').innerText(), /cannot be read to its end/);
    await shown.goto(`${at}/#play/${MISSING}`);
    await shown.locator('#banner', { hasText: 'no such recording' }).waitFor(WAIT);
    assert.match(await shown.locator('#banner').innerText(), /The list of worlds has the recordings/);
    assert.doesNotMatch(await shown.locator('#banner').innerText(), /Connecting again/);
  });
});

test('the page says how old its picture is', async () => {
  await apart(async (shown, fake) => {
    const fresh = shown.locator('#fresh');
    await fresh.filter({ hasText: 'live' }).waitFor(WAIT);
    fake.mute = true;
    await fresh.filter({ hasText: 'stale' }).waitFor(WAIT);
    fake.mute = false;
    await fresh.filter({ hasText: 'live' }).waitFor(WAIT);
  });
});

test('all that can be clicked can be reached by the keyboard', async () => {
  await apart(async (shown) => {
    const unreachable = (await shown.evaluate(`[...document.querySelectorAll('a, button, input, select, canvas#world')]
      .filter((element) => element.getClientRects().length > 0 && !element.disabled)
      .filter((element) => (element.focus(), document.activeElement !== element || element.tabIndex < 0))
      .map((element) => element.outerHTML.slice(0, 80))`)) as string[];
    assert.deepEqual(unreachable, []);
    await shown.locator('#world').focus();
    await shown.keyboard.press('t');
    await shown.waitForFunction('tessera.view.rig.pitch < -1.4', undefined, WAIT);
    const wide = () => shown.evaluate('document.body.classList.contains("wide")');
    const before = await wide();
    await shown.keyboard.press('m');
    assert.equal(await wide(), !before);
    await shown.keyboard.press('m');
    assert.equal(await wide(), before);
  });
});

test('the page is as dark or light as the system', async () => {
  const paper: Record<string, number> = {};
  for (const dark of [true, false]) {
    await apart(
      async (shown) => {
        const [red] = (await shown.evaluate('getComputedStyle(document.body).backgroundColor.match(/[0-9]+/g).map(Number)')) as number[];
        paper[String(dark)] = red!;
        const sky = (await shown.evaluate('tessera.view.scene.background.r')) as number;
        assert.equal(sky > 0.4, !dark, `the sky’s red is ${sky}`);
      },
      { dark },
    );
  }
  assert.ok(paper['true']! < 80 && paper['false']! > 180, `${paper['true']} and ${paper['false']}`);
});
