import { open, page as opened, until } from './browser.mjs';
const [address, label='', w='640', h='480'] = process.argv.slice(2);
const problems = [];
const { context, close } = await open({ viewport: { width: +w, height: +h } });
const page = await opened(context, address, problems);
const cdp = await context.newCDPSession(page);
const begin = Date.now();
await page.goto(`${address}/#/jobs/large/view`);
const canvas = page.locator('.viewer canvas');
let first; 
const settled = async (what, limit = 240_000) => until(what, async () => {
  const d = await canvas.evaluate((c) => ({ ...c.dataset }));
  if (!first && +d.buildings > 0) first = Date.now() - begin;
  return d.loading === 'false' && +d.buildings > 0 && +d.buildings;
}, limit);
const stats = async (name) => {
  const n = await settled(name);
  await page.waitForTimeout(2500); await settled(name);
  const log = await (await fetch(address + '/log')).json();
  const glb = log.filter(([f]) => f.endsWith('.glb'));
  const kind = {}; for (const [f, b] of glb) { const k = f.replace(/^[\d_-]+\./, ''); kind[k] ??= [0, 0]; kind[k][0]++; kind[k][1] += b; }
  const { JSHeapUsedSize: heap } = Object.fromEntries((await cdp.send('Performance.getMetrics')).metrics.map((m) => [m.name, m.value]));
  const info = await page.evaluate(() => ({ ...window.gableStage.renderer.info.render, ...window.gableStage.renderer.info.memory }));
  const fps = await page.evaluate(() => window.gableStage.turn(5000));
  await settled(name);
  console.log(label, name, JSON.stringify({ buildings: n, first, ms: Date.now() - begin, requests: glb.length, mb: +(glb.reduce((s, [, b]) => s + b, 0) / 1e6).toFixed(1), kind, heapMB: Math.round(heap / 1e6), info, fps: +fps.toFixed(1) }));
};
await cdp.send('Performance.enable');
await page.waitForTimeout(1500);
await stats('all');
await page.screenshot({ path: `/tmp/large/view/${label}-all.png` });
await page.evaluate(() => window.gableStage.aslant());
await page.evaluate(() => { const s = window.gableStage; const t = s.controls.target.clone(); s.fly(t, 500, 0.64, 0.77); });
await stats('near');
await page.screenshot({ path: `/tmp/large/view/${label}-near.png` });
await page.evaluate(() => window.gableStage.home());
await stats('all again');
if (problems.length) console.log(problems.slice(0, 5));
await close();
