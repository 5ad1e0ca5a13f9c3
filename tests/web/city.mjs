// A job that was sent without a word about the viewer opens with its city: node city.mjs ADDRESS TOKEN JOB CITY SHOTS
//
// The last line is what was measured, as JSON.

import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { check, logIn, open, page as opened, until } from './browser.mjs';

const [address, token, job, city, shots] = process.argv.slice(2);
mkdirSync(shots, { recursive: true });
const problems = [];
const measured = {};
const { context, close } = await open();
await logIn(context, token);
const page = await opened(context, address, problems);
const api = async (path) => (await fetch(`${address}/api/v1${path}`, { headers: { authorization: `Bearer ${token}` } })).json();
const canvas = page.locator('.viewer canvas');

/// Waits until the viewer has loaded all that it wants to show.
async function loaded() {
  await until('the city is loaded', async () => {
    const found = await canvas.evaluate((c) => ({ ...c.dataset }));
    return found.loading === 'false' && Number(found.buildings) > 0;
  });
  await page.waitForTimeout(500);
}

/// Where the middle of each building that is drawn is in the picture, from -1 to 1, by its id.
const drawn = () => page.evaluate(() => window.gableStage.drawn());

const inPicture = ([x, y]) => Math.abs(x) < 1 && Math.abs(y) < 1;

try {
  const index = await api(`/jobs/${job}/files/index.json`);
  check(index.buildings > 3, `the city has buildings: ${index.buildings}`);
  await page.goto(`${address}/#/jobs/${job}`);
  await page.getByRole('link', { name: 'Open the city' }).click();
  await loaded();
  const all = await until('all buildings', async () => {
    const found = await drawn();
    return Object.keys(found).length === index.buildings && found;
  }, 60_000);
  const places = Object.values(all);
  check(places.every(inPicture), `every building is in the picture: ${JSON.stringify(all)}`);
  // They fill it: the view opens on the buildings, not on a corner of the ground.
  const reach = (axis) => Math.max(...places.map((p) => p[axis])) - Math.min(...places.map((p) => p[axis]));
  check(Math.max(reach(0), reach(1)) > 0.8, `the buildings fill the picture: ${reach(0)}, ${reach(1)}`);
  check(await page.getByText(`${index.buildings} buildings`).isVisible(), 'their number is told');
  measured.buildings = places.length;
  await until('the ground', async () => (await page.evaluate(() => window.gableStage.frames.length)) > 3);
  await page.waitForTimeout(1500);
  await page.screenshot({ path: join(shots, 'city-from-curl.png') });

  for (const place of [`jobs/${job}`, `cities/${city}`]) {
    // The one that is farthest from the middle: it would be small in the picture of all.
    const [id] = Object.entries(all).sort((a, b) => Math.hypot(...b[1]) - Math.hypot(...a[1]))[0];
    await page.goto('about:blank');
    await page.goto(`${address}/#/${place}/view?building=${encodeURIComponent(id)}`);
    await page.getByRole('complementary', { name: 'Building' }).getByRole('heading', { level: 2, name: id }).waitFor();
    await loaded();
    const at = (await drawn())[id];
    check(at && Math.hypot(...at) < 0.35, `${id} is in the middle of the picture: ${at}`);
    check((await page.evaluate(() => window.gableStage.marked())) === id, 'the building is marked');
    await page.screenshot({ path: join(shots, `building-of-${place.split('/')[0]}.png`) });

    await page.goto('about:blank');
    await page.goto(`${address}/#/${place}/view?building=no-such-building`);
    const alert = page.getByRole('alert');
    await alert.getByText('There is no building no-such-building here').waitFor();
    await loaded();
    check(Object.values(await drawn()).some(inPicture), 'the city is there all the same');
    await page.screenshot({ path: join(shots, `no-building-of-${place.split('/')[0]}.png`) });
    await alert.getByRole('button', { name: 'Look at the whole city' }).click();
    await alert.waitFor({ state: 'detached' });
    check(!page.url().includes('building='), 'the address is that of the city');
  }

  // A result of before 3D Tiles were always written: the tiles with buildings, not the first.
  await page.route(`**/api/v1/jobs/${job}/files`, async (route) => {
    const answer = await route.fetch();
    const files = await answer.json();
    await route.fulfill({ response: answer, json: files.filter((f) => !f.path.startsWith('3dtiles/')) });
  });
  await page.goto('about:blank');
  await page.goto(`${address}/#/jobs/${job}/view`);
  await loaded();
  const old = await drawn();
  check(Object.keys(old).length === index.buildings && Object.values(old).every(inPicture), `all buildings are drawn from CityJSON: ${Object.keys(old).length}`);
  await page.getByText('This result has no 3D Tiles').waitFor();
  await page.screenshot({ path: join(shots, 'city-without-3dtiles.png') });
  check(problems.length === 0, problems.join('\n'));
} catch (error) {
  await page.screenshot({ path: join(shots, 'failed-city.png') }).catch(() => {});
  problems.forEach((problem) => console.error(problem));
  console.error(error.stack, `\nat ${page.url()}`);
  process.exitCode = 1;
}
await close();
console.log(JSON.stringify(measured));
