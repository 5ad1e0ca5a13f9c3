// An operator's day at the dashboard: node dashboard.mjs ADDRESS TOKEN MESH LATER_MESH MARKER SHOTS
//
// The service has one block that fails as long as the file MARKER exists. Pictures of all pages go to the folder SHOTS. The last line is
// what was measured, as JSON.

import { existsSync, mkdirSync, rmSync } from 'node:fs';
import { join } from 'node:path';
import { check, logIn, open, page as opened, until } from './browser.mjs';

const [address, token, mesh, later, marker, shots] = process.argv.slice(2);
mkdirSync(shots, { recursive: true });
const problems = [];
const measured = {};
const { context, close } = await open();
await logIn(context, token);
const page = await opened(context, address, problems);
const authorization = `Bearer ${token}`;
const api = async (path) => (await fetch(`${address}/api/v1${path}`, { headers: { authorization } })).json();
const go = (hash) => page.goto(`${address}/#/${hash}`);
const step = (text) => console.error(`- ${text}`);

const LOOKS = [['light', 1360, 850], ['dark', 1360, 850], ['light', 390, 844], ['dark', 390, 844]];

/// The two that differ most, for what is simple.
const TWO_LOOKS = [LOOKS[0], LOOKS[3]];

/// Pictures of what is shown, in all looks.
async function shoot(name, settle = async () => {}, looks = LOOKS) {
  for (const [scheme, width, height] of looks) {
    await page.emulateMedia({ colorScheme: scheme });
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(250);
    await settle();
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    check(wide <= 0, `${name} at ${width} px is ${wide} px too wide`);
    // Nothing of a table is out of sight, for nothing would say that it is there.
    const cut = await page.evaluate(() => [...document.querySelectorAll('.scroll, .seams')].filter((e) => e.scrollWidth > e.clientWidth).length);
    check(cut === 0, `${name} at ${width} px: ${cut} tables are cut`);
    await page.screenshot({ path: join(shots, `${name}-${scheme}-${width > 700 ? 'wide' : 'phone'}.png`) });
  }
  await page.emulateMedia({ colorScheme: 'light' });
  await page.setViewportSize({ width: 1360, height: 850 });
}

/// Fills in the form for a mesh, and gives the id of the job.
async function submit(source) {
  await go('submit');
  await page.getByLabel('Mesh', { exact: true }).fill(source);
  await page.getByLabel('City', { exact: true }).fill('delft');
  const set = async (name, value) => page.locator(`[id="p-${name}"]`).fill(value);
  await set('grid.columns', '8');
  await set('grid.rows', '8');
  await set('sampling.step', '0.5');
  // Small patches, so that a change far away is not seen.
  await page.locator('summary', { hasText: 'segmentation' }).click();
  await set('segmentation.patch', '64');
  await set('segmentation.margin', '16');
  check(await page.getByRole('checkbox', { name: '3dtiles', exact: true }).isChecked(), 'jobs from the page can be looked at');
  await page.getByRole('button', { name: 'Submit' }).click();
  await page.waitForURL(/#\/jobs\/[^/?]+$/);
  return page.url().split('/').at(-1);
}

const state = async (id) => (await api(`/jobs/${id}`)).state;

/// Waits until the viewer has loaded all that it wants to show.
async function loaded(lod) {
  const canvas = page.locator('.viewer canvas');
  await until(`the city at LOD ${lod}`, async () => {
    const found = await canvas.evaluate((c) => ({ ...c.dataset }));
    return found.lod === lod && found.loading === 'false' && Number(found.buildings) > 0;
  });
  await page.waitForTimeout(400);
}

/// Surfaces of all buildings that are shown, by kind.
const surfaces = () =>
  page.evaluate(() => {
    const found = {};
    window.gableStage.meshes((mesh) => mesh.userData.features.surfaces.forEach((s) => (found[s.kind] = (found[s.kind] ?? 0) + 1)));
    return found;
  });

try {
  step('an empty service says what to do');
  await page.goto(address);
  await page.getByText('No job yet').waitFor();
  const fetched = await page.evaluate(() => [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')].map((e) => [new URL(e.name).pathname, e.encodedBodySize]));
  const assets = fetched.filter(([path]) => !path.startsWith('/api/'));
  measured.first_page_bytes = assets.reduce((sum, [, bytes]) => sum + bytes, 0);
  check(assets.length >= 3 && measured.first_page_bytes > 10_000 && measured.first_page_bytes < 150_000, `the first page is small: ${JSON.stringify(assets)}`);
  check(!assets.some(([path]) => path.includes('viewer')), 'three.js comes with the viewer only');
  await shoot('jobs-empty');

  step('submit from the page');
  await go('submit');
  await page.getByLabel('Mesh', { exact: true }).fill(`${mesh}/not-there`);
  await page.getByLabel('City', { exact: true }).fill('delft');
  await page.getByRole('button', { name: 'Submit' }).click();
  await page.getByRole('alert').first().waitFor();
  await shoot('submit');
  const first = await submit(mesh);

  step('its priority is changed');
  const priority = page.getByLabel('Priority');
  await priority.fill('7');
  await page.getByRole('button', { name: 'Set', exact: true }).click();
  await until('another priority', async () => (await api(`/jobs/${first}`)).priority === 7);

  step('the grid fills');
  const count = (look) => page.locator(`.grid .cell${look}`).count();
  await until('a block that runs', () => count('.running'));
  const early = await until('some blocks that are done', () => count('.done'));
  await shoot('job-running');
  await until('more blocks that are done', async () => (await count('.done')) > early);
  await until('the end of the job', async () => ['partial', 'successful', 'failed'].includes(await state(first)));
  check((await state(first)) === 'partial', `a block was to fail: ${await state(first)}`);

  step('a failed block is told first, and can be retried');
  const failures = page.locator('.failures');
  await failures.getByText('1 unit failed').waitFor();
  check((await count('.failed')) === 1, 'one block is red');
  await failures.getByRole('button', { name: /^Block 2, 2/ }).click();
  const block = page.getByRole('region', { name: 'Block 2, 2' });
  await block.getByText('signal').first().waitFor();
  await block.locator('summary', { hasText: 'Log' }).click();
  await block.getByLabel('Log of the unit').filter({ hasText: 'failed: signal' }).waitFor();
  await shoot('job-failed');
  rmSync(marker);
  await failures.getByRole('button', { name: 'Retry' }).click();
  await until('the job, mended', async () => (await state(first)) === 'successful');
  await page.locator('.state.successful').first().waitFor();
  await until('no block that failed', async () => (await count('.failed')) === 0);
  step('seams');
  const seams = page.getByRole('region', { name: 'Seams' });
  const known = await api(`/jobs/${first}/seams`);
  check(known.length > 0 && known.every((s) => s.blocks.length > 1 && s.buildings > 0), `some buildings cross borders: ${JSON.stringify(known)}`);
  await until('seams that are done', async () => (await seams.locator('tbody .state.done, tbody .state.reused').count()) === Math.min(40, known.length));
  await seams.getByText(`across ${known.length} seam`).waitFor();

  await block.locator('.plan image').waitFor();
  await block.scrollIntoViewIfNeeded();
  await shoot('job-done');
  for (const by of ['seconds', 'attempts', 'phase']) {
    await page.getByLabel('Colour units by').selectOption(by);
    check(page.url().includes(`by=${by}`), 'what is shown has an address');
  }
  check((await page.locator('.grid .cell.phase-write').count()) > 10, 'all blocks are written');

  step('the city, its levels, a building');
  await page.getByRole('link', { name: 'Open the city' }).click();
  await loaded('auto');
  await shoot('viewer', () => loaded('auto'));
  const counted = {};
  for (const [button, lod] of [['LOD0', '0'], ['LOD1', '1'], ['LOD2', '2']]) {
    await page.getByRole('button', { name: button }).click();
    await loaded(lod);
    counted[button] = await surfaces();
  }
  // Between two requests of a slow machine nothing may be under way for a moment.
  const index = await api(`/jobs/${first}/files/index.json`);
  const loadedBuildings = async () => Number(await page.locator('.viewer canvas').getAttribute('data-buildings'));
  await until(`all ${index.buildings} buildings are shown`, async () => (await loadedBuildings()) >= index.buildings, 30_000);
  check((await loadedBuildings()) === index.buildings, 'no building is shown twice');
  counted.LOD2 = await surfaces();
  check(!counted.LOD0.WallSurface && counted.LOD0.RoofSurface > 0, `LOD0 is flat: ${JSON.stringify(counted)}`);
  check(counted.LOD1.WallSurface > 0, 'LOD1 has walls');
  check(counted.LOD2.RoofSurface > counted.LOD1.RoofSurface, `LOD2 has roof shapes: ${JSON.stringify(counted)}`);

  await page.getByRole('button', { name: 'Above' }).click();
  await page.waitForTimeout(300);
  const place = await page.evaluate(() => window.gableStage.locate());
  await page.mouse.click(place.x, place.y);
  const card = page.getByRole('complementary', { name: 'Building' });
  await card.waitFor();
  const id = await card.getByRole('heading', { level: 2 }).innerText();
  const tiles = await Promise.all(index.tiles.flatMap((t) => t.files.filter((f) => f.endsWith('.city.json'))).map((f) => api(`/jobs/${first}/files/${f}`)));
  const truth = tiles.map((t) => t.CityObjects[id]).find(Boolean)?.attributes;
  check(truth && id === place.id, `the building that was clicked is ${place.id}, the one told ${id}`);
  const told = await card.innerText();
  check(told.includes(truth.roofType) && told.includes(`${truth.measuredHeight} m`) && told.includes(`${truth.rmse_m} m`), `its attributes are told: ${told}`);
  step('the mesh beside and under the model');
  await page.getByRole('button', { name: 'Aslant' }).click();
  const canvas = page.locator('.viewer canvas');
  const compared = async (name) => {
    await page.getByRole('button', { name, exact: true }).click();
    await until(`the mesh, ${name}`, async () => {
      const found = await canvas.evaluate((c) => ({ ...c.dataset }));
      return found.loading === 'false' && Number(found.mesh) > 0;
    });
    await page.waitForTimeout(300);
    return canvas.screenshot();
  };
  const pictures = [];
  for (const name of ['Mesh', 'Both', 'Swipe']) {
    pictures.push(await compared(name));
    check(page.url().includes(`compare=${name.toLowerCase()}`), 'what is compared has an address');
    await page.screenshot({ path: join(shots, `viewer-compare-${name.toLowerCase()}.png`) });
  }
  check(!pictures[0].equals(pictures[1]) && !pictures[1].equals(pictures[2]), 'each way to compare looks different');
  const border = page.getByRole('slider', { name: 'Border between mesh and model' });
  check((await border.getAttribute('aria-valuenow')) === '50', 'half and half');
  await border.focus();
  for (let i = 0; i < 5; i++) await page.keyboard.press('ArrowRight');
  check((await border.getAttribute('aria-valuenow')) === '60', 'arrow keys move the border');
  await page.waitForTimeout(300);
  check(!pictures[2].equals(await canvas.screenshot()), 'the border moves in the picture');
  await page.mouse.move(680, 400);
  await shoot('viewer-compare', () => page.waitForTimeout(500));
  await page.getByRole('button', { name: 'Model', exact: true }).click();
  await until('the model alone', async () => (await canvas.getAttribute('data-mesh')) === '0');

  for (const mode of ['height', 'roof type', 'RMSE', 'method', 'semantics']) {
    await page.getByLabel('Colour', { exact: true }).selectOption(mode);
    await page.locator('.key strong', { hasText: mode }).waitFor();
    if (mode === 'height' || mode === 'roof type') await page.screenshot({ path: join(shots, `viewer-${mode.replace(' ', '-')}.png`) });
  }
  await page.getByRole('button', { name: 'Aslant' }).click();
  await shoot('viewer-building', () => page.waitForTimeout(300));

  step('a link to a building, and one tile as CityJSON');
  await page.goto('about:blank');
  await go(`jobs/${first}/view?building=${id}`);
  await loaded('auto');
  await card.getByRole('heading', { level: 2, name: id }).waitFor();
  await card.getByRole('button', { name: 'show it alone' }).click();
  const alone = tiles.find((t) => t.CityObjects[id]);
  const own = Object.values(alone.CityObjects).filter((o) => o.type === 'Building').length;
  await until('one tile', async () => Number(await page.locator('.viewer canvas').getAttribute('data-buildings')) === own);
  check((await page.getByLabel('Show', { exact: true }).inputValue()).endsWith('.city.json'), 'the file has an address');
  await page.waitForTimeout(300);
  await page.screenshot({ path: join(shots, 'viewer-cityjson.png') });

  step('frames a second');
  await go(`jobs/${first}/view`);
  await page.setViewportSize({ width: 640, height: 480 });
  await loaded('auto');
  measured.frames_per_second = Math.round(10 * (await page.evaluate(() => window.gableStage.turn(4000)))) / 10;
  await page.setViewportSize({ width: 1360, height: 850 });

  step('a refresh, and what it changed');
  const second = await submit(later);
  await until('the end of the refresh', async () => ['partial', 'successful', 'failed'].includes(await state(second)));
  check((await state(second)) === 'successful', 'the refresh is whole');
  // Blocks are shown as taken over whose last stage was.
  const units = await api(`/jobs/${second}/blocks`);
  const taken = units.filter((u) => u.stage === 'write' && u.state === 'reused').length;
  check(units.some((u) => u.state === 'reused'), 'something is taken over');
  await until(`${taken} blocks that were taken over`, async () => (await count('.reused')) === taken, 20_000);
  await shoot('job-refresh');
  // The city with the failed block was published, then the mended one, then the refresh.
  const { changes } = await api('/cities/delft/changes?from=2&to=3');
  await go('cities');
  await page.getByRole('heading', { name: 'delft' }).waitFor();
  await shoot('cities');
  await page.getByRole('link', { name: 'Generations' }).click();
  await page.getByText('Changes from generation 2 to 3').waitFor();
  const list = page.getByRole('list', { name: 'Changed buildings' });
  await list.getByRole('listitem').first().waitFor();
  check((await list.getByRole('listitem').count()) === changes.length, 'all changes are listed');
  for (const kind of ['added', 'removed', 'changed']) {
    check((await page.locator(`.map path.${kind}`).count()) === changes.filter((c) => c.change === kind).length, `what is ${kind} is on the map`);
  }
  await list.getByRole('button').first().click();
  await page.locator('.map path.chosen').waitFor();
  await shoot('city');
  measured.changes = changes.length;
  await list.getByRole('link', { name: 'open' }).first().click();
  await loaded('auto');
  await card.getByRole('heading', { level: 2, name: changes[0].id }).waitFor();
  await go('jobs');
  await page.locator('.job .name').first().waitFor();
  await shoot('jobs');
  await go('workers');
  await page.getByRole('rowheader').first().waitFor();
  await shoot('workers');
  step('a mesh of one\'s own machine is sent, chosen or dropped');
  await go('submit');
  const source = page.getByLabel('Mesh', { exact: true });
  const tiny = Buffer.from('OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n');
  await page.locator('.drop input').setInputFiles({ name: 'chosen (1).off', mimeType: 'text/plain', buffer: tiny });
  await until('the mesh is there', async () => (await source.inputValue()).startsWith('upload:'));
  const chosen = await source.inputValue();
  const dropped = await page.evaluateHandle(() => {
    const data = new DataTransfer();
    data.items.add(new File(['OFF\n0 0 0\n'], 'dropped.off'));
    return data;
  });
  await page.locator('.drop').dispatchEvent('drop', { dataTransfer: dropped });
  await until('the other mesh is there', async () => ![chosen, ''].includes(await source.inputValue()));
  const uploads = await api('/uploads');
  check(uploads.map((u) => u.name).join() === 'dropped.off,chosen _1_.off', JSON.stringify(uploads));
  check(uploads[1].bytes === tiny.length, 'all of it has come');
  const wrong = await page.evaluateHandle(() => {
    const data = new DataTransfer();
    data.items.add(new File(['x'], 'letter.doc'));
    return data;
  });
  await page.locator('.drop').dispatchEvent('drop', { dataTransfer: wrong });
  await page.getByText('letter.doc is no mesh that can be sent').waitFor();
  await shoot('sent', async () => {}, TWO_LOOKS);
  await go('schedules');
  await page.getByText('No schedule').waitFor();
  const put = await fetch(`${address}/api/v1/schedules/nightly`, {
    method: 'PUT',
    headers: { authorization, 'content-type': 'application/json' },
    body: JSON.stringify({ cron: '30 2 * * MON', zone: 'Europe/Amsterdam', job: { source: later, city: 'delft' } }),
  });
  check(put.ok, `a schedule is taken: ${put.status}`);
  await page.reload();
  await page.getByRole('rowheader', { name: 'nightly' }).waitFor();
  await page.getByRole('button', { name: 'History' }).click();
  await page.getByText('It has not run yet').waitFor();
  await shoot('schedules');

  step('what is not there, and a service that does not answer');
  await go('jobs/01a000000000000000000000000000');
  await page.getByRole('alert').waitFor();
  await shoot('job-missing', undefined, TWO_LOOKS);
  await go('cities/atlantis');
  await page.getByRole('alert').waitFor();
  await page.getByRole('link', { name: 'All cities' }).waitFor();
  await shoot('city-missing', undefined, TWO_LOOKS);
  await page.route('**/api/v1/jobs?*', (route) => route.abort());
  await go('jobs');
  await page.getByText('The service does not answer').waitFor();
  await shoot('jobs-error', undefined, TWO_LOOKS);
  await page.unroute('**/api/v1/jobs?*');
  await page.getByText('The service does not answer').waitFor({ state: 'detached' });
  await page.route('**/3dtiles/buildings.json*', (route) => route.fulfill({ status: 503, json: { title: 'The service is not ready', detail: 'the database or the object store does not answer: try again' } }));
  await go(`jobs/${first}/view`);
  await page.getByText('The service is not ready').waitFor();
  await shoot('viewer-error', undefined, TWO_LOOKS);
  await page.unroute('**/3dtiles/buildings.json*');

  step('keyboard');
  await go(`jobs/${first}`);
  await page.locator('.grid [data-unit]').first().waitFor();
  await page.locator('.grid [data-unit="3_3"]').focus();
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('ArrowUp');
  await page.keyboard.press('Enter');
  await page.getByRole('region', { name: 'Block 4, 4' }).waitFor();

  step('what a poll of 256 blocks costs');
  let turn = 0;
  const job = await api(`/jobs/${first}`);
  const state256 = (age) => (age > 8 ? 'done' : age > 0 ? 'running' : 'ready');
  // As the service tells them: 256 blocks in each stage that has blocks, patches, and what there is once. A dozen changes from poll to poll.
  const kinds = { split: 'scene', sample: 'block', segment: 'patch', model: 'tile', write: 'tile' };
  const unit256 = (stage, name, age) => ({
    stage, kind: kinds[stage] ?? 'city', unit: name, state: state256(age), attempts: age > 0 ? 1 : 0,
    ...(age > 0 ? { worker: 'worker-1-4711-0-01a226730d8877ec9c2b99fd9ec2ff27', started: job.created } : {}),
    ...(age > 0 && age <= 8 ? { phase: 'rasterising' } : {}),
    ...(age > 8 ? { seconds: 1 + (age % 7) } : {}),
  });
  const units256 = () => [
    unit256('split', 'scene', 9), unit256('terrain', 'city', turn * 12 - 300), unit256('stitch', 'city', turn * 12 - 700), unit256('report', 'city', -1),
    ...['sample', 'segment', 'model', 'write'].flatMap((stage, s) =>
      Array.from({ length: 256 }, (_, i) => unit256(stage, `${stage === 'segment' ? 'patch_' : ''}${i % 16}_${Math.floor(i / 16)}`, turn * 12 - s * 60 - i))),
  ];
  const square = (kind, start, edge) => Array.from({ length: 256 }, (_, i) => {
    const [x, y] = [i % 16, Math.floor(i / 16)];
    return { kind, unit: `${start}${x}_${y}`, bbox: [x * edge, y * edge, (x + 1) * edge, (y + 1) * edge] };
  });
  await page.route('**/api/v1/jobs/large/map', (route) => route.fulfill({
    json: { crs: 'EPSG:7415', bbox: [0, 0, 3200, 3200], picture: false, units: [...square('block', '', 200), ...square('patch', 'patch_', 204.8)] },
  }));
  await page.route('**/api/v1/jobs/large', (route) => {
    const units = units256();
    const progress = job.progress.map(({ stage }) => {
      const own = units.filter((u) => u.stage === stage);
      const of = (state) => own.filter((u) => u.state === state).length;
      return { stage, ready: of('ready'), running: of('running'), done: of('done'), failed: 0, cancelled: 0 };
    });
    return route.fulfill({ json: { ...job, id: 'large', state: 'running', stage: 'sample', finished: undefined, progress }, headers: { etag: `"${turn}"` } });
  });
  await page.route('**/api/v1/jobs/large/events/stream', (route) => route.fulfill({ body: '', contentType: 'text/event-stream' }));
  await page.route('**/api/v1/jobs/large/blocks', (route) => {
    turn++;
    return route.fulfill({ json: units256(), headers: { etag: `"${turn}"` } });
  });
  await go('jobs/large');
  await page.locator('.grid [data-unit="15_15"]').waitFor();
  // What else a machine does makes a poll dearer, never cheaper: the best of some rounds counts.
  for (let round = 0; round < 3 && !(measured.poll_ms < 5); round++) {
    await page.evaluate(() => (window.gablePollCosts.length = 0));
    await page.waitForTimeout(16_000);
    const all = await page.evaluate(() => window.gablePollCosts);
    const [heads, blocks] = ['large', 'blocks'].map((end) => all.filter((c) => c.path.endsWith(`/${end}`)).map((c) => c.ms));
    check(heads.length >= 5 && blocks.length >= 5, `${heads.length} and ${blocks.length} polls`);
    // The page asks for the job and for its blocks: both are one poll.
    const costs = blocks.map((ms, i) => ms + (heads[i] ?? heads.at(-1))).sort((a, b) => a - b);
    const median = Math.round(100 * costs[Math.floor(costs.length / 2)]) / 100;
    if (median >= (measured.poll_ms ?? Infinity)) continue;
    measured.poll_ms = median;
    measured.poll_worst_ms = Math.round(100 * costs.at(-1)) / 100;
  }

  step('10,000 jobs');
  const all = Array.from({ length: 10_000 }, (_, i) => ({ ...job, id: String(20_000 - i), city: `city ${20_000 - i}` }));
  await page.route('**/api/v1/jobs?*', (route) => {
    const query = new URL(route.request().url()).searchParams;
    const limit = Number(query.get('limit'));
    const begin = query.get('before') ? all.findIndex((j) => j.id < query.get('before')) : 0;
    const jobs = all.slice(begin, begin + limit);
    return route.fulfill({ json: { jobs, next: begin + limit < all.length ? jobs.at(-1).id : undefined } });
  });
  await go('jobs');
  await page.reload();
  await page.getByText('city 20000').waitFor();
  const scrolled = await page.evaluate(async () => {
    const frame = document.querySelector('.rows');
    const times = [];
    let [last, most, end] = [performance.now(), 0, performance.now() + 40_000];
    while (performance.now() < end && frame.scrollTop < 9_900 * 52) {
      frame.scrollTop += 800;
      await new Promise(requestAnimationFrame);
      times.push(performance.now() - last);
      last = performance.now();
      most = Math.max(most, document.querySelectorAll('.job').length);
    }
    times.sort((a, b) => a - b);
    return { rows: most, reached: frame.scrollTop / 52, median: times[times.length >> 1], slow: times[Math.floor(times.length * 0.95)] };
  });
  check(scrolled.rows < 80, `${scrolled.rows} rows in the document`);
  check(scrolled.reached > 9_000, `scrolled to row ${scrolled.reached}`);
  measured.scroll_frame_ms = Math.round(10 * scrolled.median) / 10;
  measured.scroll_frame_p95_ms = Math.round(10 * scrolled.slow) / 10;
  check(problems.length === 0, problems.join('\n'));
} catch (error) {
  await page.screenshot({ path: join(shots, 'failed.png') }).catch(() => {});
  problems.forEach((problem) => console.error(problem));
  console.error(error.stack, `\nat ${page.url()}`);
  process.exitCode = 1;
}
await close();
if (!existsSync(shots)) process.exitCode = 1;
console.log(JSON.stringify(measured));
