// Pictures of the page: node build/tests/shots.mjs ADDRESS FOLDER

import { launch, open } from './browser.ts';

const [address, folder] = process.argv.slice(2) as [string, string];
const browser = await launch();
const { page, complaints } = await open(browser, address);
page.on('console', (m) => console.log(m.text()));
try { await page.waitForFunction('window.tessera && tessera.counts.frames > 20', undefined, { timeout: 20000 }); } catch { console.log(JSON.stringify(complaints)); await page.screenshot({ path: `${folder}/a.png` }); process.exit(1); }
await page.screenshot({ path: `${folder}/a.png` });
await page.click('#tools button:has-text("Shadows")');
await page.waitForTimeout(4000);
await page.screenshot({ path: `${folder}/b.png` });
console.log(JSON.stringify(await page.evaluate('tessera.counts')), JSON.stringify(complaints));
console.log(await page.evaluate('JSON.stringify([tessera.perf.rate, tessera.perf.own_ms.slice(-20), tessera.perf.whole_ms.slice(-5)])'));
await browser.close();
