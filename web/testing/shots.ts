// A picture of the page with a real world, for the README: node build/bundles-cluster/shots.mjs FILE [BIN]

import { launch, open } from './browser.ts';
import { LocalCluster } from './local_cluster.ts';

const WAIT_S = 120;
const SAMPLES = 30; // points in the charts, one a second

const [file = 'page.png', bin = '../build/dev/bin'] = process.argv.slice(2);
const cluster = await LocalCluster.start(bin);
await cluster.tessera('instance', 'create', '--scene', 'plaza', '--bodies', '800', '--regions', '4', '--wait');
const swarm = cluster.tessera('swarm', 'inst-1', '--players', '12', '--seconds', String(WAIT_S)).catch(() => '');
const browser = await launch();
const { page } = await open(browser, cluster.page);
await page.locator('a.card', { hasText: 'inst-1' }).click();
const end = performance.now() + 1000 * WAIT_S;
while (!(await page.evaluate(`window.tessera && tessera.session.room.samples.length > ${SAMPLES} && tessera.session.room.status.unprotected.length === 0`))) {
  if (performance.now() > end) throw new Error('the world did not run long enough');
  await page.evaluate('new Promise((done) => requestAnimationFrame(done))');
}
// Nearer than the page's own overview, which leaves room around.
await page.evaluate('(({ rig }) => rig.set(rig.camera.position.clone().lerp(rig.controls.target, 0.3).toArray(), rig.controls.target.toArray()))(tessera.view)');
await page.evaluate('new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))');
await page.screenshot({ path: file });
await browser.close();
await cluster.stop();
await swarm;
