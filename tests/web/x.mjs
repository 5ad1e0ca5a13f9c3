import { open, page as opened } from './browser.mjs';
const problems = [];
const { context, close } = await open();
const page = await opened(context, 'http://127.0.0.1:18082', problems);
for (const [name, hash, wait] of JSON.parse(process.argv[2])) {
  await page.goto('about:blank');
  await page.goto('http://127.0.0.1:18082/#/' + hash);
  await page.waitForTimeout(wait ?? 6000);
  await page.screenshot({ path: `/tmp/shots/x-${name}.png` });
  console.log(name, await page.locator('canvas').evaluate((c) => JSON.stringify(c.dataset)).catch(() => ''));
}
console.log(await page.evaluate(() => window.gableStage?.turn(4000)).catch((e) => e.message));
console.log(problems.slice(0, 5).join('\n'));
await close();
