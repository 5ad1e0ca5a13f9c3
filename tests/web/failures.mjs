// What failed lies on the map, and its reason is told once: node failures.mjs ADDRESS TOKEN PARTIAL FAILED SHOTS
//
// Of the job PARTIAL some patches failed, of the job FAILED the stitching. The last line is what was measured, as JSON.

import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { check, logIn, open, page as opened, until } from './browser.mjs';

const [address, token, partial, failed, shots] = process.argv.slice(2);
mkdirSync(shots, { recursive: true });
const problems = [];
const { context, close } = await open();
await logIn(context, token);
const page = await opened(context, address, problems);
const api = async (path) => (await fetch(`${address}/api/v1${path}`, { headers: { authorization: `Bearer ${token}` } })).json();

/// West, south, east, north of a unit on the page, metres, from where it is drawn.
async function drawnAt(name, bounds) {
  const frame = await page.locator('.grid').boundingBox();
  const cell = await page.locator(`.grid [data-unit="${name}"]`).boundingBox();
  const [width, height] = [bounds[2] - bounds[0], bounds[3] - bounds[1]];
  const x = (at) => bounds[0] + ((at - frame.x) / frame.width) * width;
  const y = (at) => bounds[3] - ((at - frame.y) / frame.height) * height;
  return [x(cell.x), y(cell.y + cell.height), x(cell.x + cell.width), y(cell.y)];
}

/// How red the picture of an element is: the mean of red less that of green and blue.
async function redness(locator) {
  const png = (await locator.screenshot()).toString('base64');
  return page.evaluate(async (data) => {
    const image = new Image();
    image.src = `data:image/png;base64,${data}`;
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height);
    const pen = canvas.getContext('2d');
    pen.drawImage(image, 0, 0);
    const pixels = pen.getImageData(0, 0, image.width, image.height).data;
    let sum = 0;
    for (let i = 0; i < pixels.length; i += 4) sum += pixels[i] - (pixels[i + 1] + pixels[i + 2]) / 2;
    return sum / (pixels.length / 4);
  }, png);
}

/// How often a reason stands on the page, the history of events apart.
async function timesTold(reason) {
  const [all, history] = await Promise.all([page.locator('main').innerText(), page.locator('.events').allInnerTexts()]);
  const times = (text) => text.replaceAll('\n', ' ').split(reason).length - 1;
  return times(all) - history.reduce((sum, text) => sum + times(text), 0);
}

try {
  const map = await api(`/jobs/${partial}/map`);
  const units = await api(`/jobs/${partial}/blocks`);
  check(map.picture && map.units.some((u) => u.kind === 'block') && map.units.some((u) => u.kind === 'patch'), `the map is known: ${JSON.stringify(map).slice(0, 300)}`);
  check(units.filter((u) => u.stage === 'segment').every((u) => u.kind === 'patch' && u.unit.startsWith('patch_')), 'patches have names of their own');
  const lost = units.filter((u) => u.state === 'failed');
  check(lost.length === 2 && lost.every((u) => u.kind === 'patch'), `two patches failed: ${JSON.stringify(lost)}`);

  await page.goto(`${address}/#/jobs/${partial}`);
  const failures = page.locator('.failures');
  await failures.getByText('2 units failed').waitFor();
  check((await failures.getByRole('listitem').count()) === 1, 'one reason, told once');
  check((await timesTold(lost[0].reason)) === 1, 'the reason is told once');
  check((await failures.innerText()).includes('--slots'), 'what to do is told with its option');
  await page.locator('.grid img').waitFor();
  // Blocks and patches lie where the service says, to a pixel or so of the page.
  for (const unit of map.units.filter((u) => u.kind === 'block' || lost.some((l) => l.unit === u.unit))) {
    const at = await drawnAt(unit.unit, map.bbox);
    check(at.every((side, i) => Math.abs(side - unit.bbox[i]) < 1.5), `${unit.unit} is drawn at ${at}, not at ${unit.bbox}`);
  }
  check((await page.locator('.grid .cell.patch.failed').count()) === 2, 'the patches that failed are on the map of the blocks');
  await page.getByRole('button', { name: /^Patch .* segment, 3 attempts/ }).first().click();
  const panel = page.locator('section.block');
  const title = await panel.getByRole('heading', { level: 2 }).innerText();
  check(title === `Patch ${lost[0].unit.replace('patch_', '').replace('_', ', ')}`, `a patch is called a patch: ${title}`);
  await panel.getByText('Lies in').waitFor();
  await page.screenshot({ path: join(shots, 'map-partial.png'), fullPage: true });
  await page.getByRole('button', { name: 'Patches', exact: true }).click();
  await until('all patches', async () => (await page.locator('.grid .cell.patch').count()) === units.filter((u) => u.kind === 'patch').length);
  check((await page.locator('.grid .cell.failed').count()) === 2, 'two of them are red');
  await page.screenshot({ path: join(shots, 'map-partial-patches.png'), fullPage: true });

  const all = await api(`/jobs/${failed}/blocks`);
  const [stitch] = all.filter((u) => u.state === 'failed');
  check(stitch.stage === 'stitch' && all.filter((u) => u.stage === 'sample').every((u) => u.state === 'done'), 'only the stitching failed');
  await page.goto(`${address}/#/jobs/${failed}`);
  await failures.getByText('1 unit failed').waitFor();
  check((await timesTold(stitch.reason)) === 1, 'the reason of the job, which is that of a unit, is told once');
  await page.locator('.grid .lost-city').waitFor();
  await page.locator('.grid img').waitFor();
  const red = await redness(page.locator('.grid'));
  check(red > 40, `a failed city is red: ${red}`);
  await failures.getByRole('button', { name: /^City stitch/ }).click();
  check((await panel.getByRole('heading', { level: 2 }).innerText()) === 'City', 'what there is once is called the city');
  for (const scheme of ['light', 'dark']) {
    await page.emulateMedia({ colorScheme: scheme });
    await page.waitForTimeout(200);
    await page.screenshot({ path: join(shots, `map-failed-${scheme}.png`), fullPage: true });
  }
  await page.setViewportSize({ width: 390, height: 844 });
  await page.waitForTimeout(200);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  check(wide <= 0, `a failed job is ${wide} px too wide on a phone`);
  await page.screenshot({ path: join(shots, 'map-failed-phone.png'), fullPage: true });
  check(problems.length === 0, problems.join('\n'));
} catch (error) {
  await page.screenshot({ path: join(shots, 'failed-failures.png'), fullPage: true }).catch(() => {});
  problems.forEach((problem) => console.error(problem));
  console.error(error.stack, `\nat ${page.url()}`);
  process.exitCode = 1;
}
await close();
console.log('{}');
