// Pictures of a real world for the README and docs/desktop.md, from the page and from the desktop client:
//
//   node build/bundles-cluster/shots.mjs PAGE.png DESKTOP.png [BIN]

import { execFile } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { promisify } from 'node:util';
import { launch, open } from './browser.ts';
import { LocalCluster } from './local_cluster.ts';

const WAIT_S = 180;
const SAMPLES = 30; // points in the charts, one a second

const [page_file = 'page.png', desktop_file = 'desktop.png', bin = '../build/dev/bin'] = process.argv.slice(2);

async function shootPage(address: string): Promise<void> {
  const browser = await launch();
  const { page } = await open(browser, address);
  const end = performance.now() + 1000 * WAIT_S;
  while (!(await page.evaluate(`window.tessera && tessera.session.room.samples.length > ${SAMPLES} && tessera.session.room.status.unprotected.length === 0`))) {
    if (performance.now() > end) throw new Error('the world did not run long enough');
    await page.evaluate('new Promise((done) => requestAnimationFrame(done))');
  }
  // Nearer than the page's own overview, which leaves room around.
  await page.evaluate('(({ rig }) => rig.set(rig.camera.position.clone().lerp(rig.controls.target, 0.3).toArray(), rig.controls.target.toArray()))(tessera.view)');
  await page.evaluate('new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))');
  await page.screenshot({ path: page_file });
  await browser.close();
}

// On a display that nobody sees.
async function shootDesktop(cluster: LocalCluster): Promise<void> {
  const script = join(cluster.folder, 'desktop.script');
  writeFileSync(script, `wait world\nhold Right\nframes 15\nrelease Right\nwait figures\nframes 2\nscreenshot ${resolve(desktop_file)}\nframes 2\nquit\n`);
  const client = [join(bin, 'tessera-desktop'), '--control', cluster.control, '--instance', 'inst-1', '--size', '1120x630', '--script', script];
  const env = { ...process.env, SDL_VIDEODRIVER: 'x11', LIBGL_ALWAYS_SOFTWARE: '1' };
  await promisify(execFile)('xvfb-run', ['--auto-servernum', '--server-args=-screen 0 1280x720x24', ...client], { env });
}

const cluster = await LocalCluster.start(bin);
try {
  await cluster.tessera('instance', 'create', '--scene', 'plaza', '--bodies', '800', '--regions', '4', '--wait');
  const swarm = cluster.tessera('swarm', 'inst-1', '--players', '12', '--seconds', String(WAIT_S)).catch(() => '');
  await shootPage(`${cluster.page}&inst-1`);
  await shootDesktop(cluster);
  await cluster.tessera('instance', 'delete', 'inst-1'); // which ends the swarm
  await swarm;
} finally {
  await cluster.stop();
}
