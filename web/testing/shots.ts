// Pictures of the page: node build/bundles-unit/shots.mjs FOLDER

import { launch, open } from './browser.ts';
import { FakeGateway } from './fake_gateway.ts';

const folder = process.argv[2] ?? '.';
const gateway = new FakeGateway({ page: 'dist', bodies: 1500, frame_ms: 50 });
const address = await gateway.listen();
for (let tick = 0; tick < 400; ++tick) gateway.world.step();
const browser = await launch();
for (const dark of [true, false]) {
  const { page } = await open(browser, `${address}/#plaza-1`, { dark });
  await page.waitForFunction('window.tessera && tessera.counts.frames > 5', undefined, { timeout: 60000 });
  await page.evaluate('document.querySelector("#tools button[title^=Draw]").click()');
  const slot = 'tessera.session.bodies.findName("crate-1000010")';
  await page.waitForFunction('tessera.session.room.samples.length > 1', undefined, { timeout: 60000 });
  if (dark) {
    await page.screenshot({ path: `${folder}/all.png` });
    gateway.kill(1);
    await page.waitForFunction('tessera.counts.dead.length > 0', undefined, { timeout: 60000 });
  }
  if (!dark) await page.evaluate(`tessera.page.select(${slot}); tessera.view.rig.set([50, 14, -6], [33, 2, -27])`);
  await page.evaluate('new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))');
  await page.screenshot({ path: `${folder}/${dark ? 'dark' : 'light'}.png` });
  await page.context().close();
}
await browser.close();
await gateway.close();
