// A viewer at a service with tokens: node login.mjs ADDRESS TOKEN SHOTS

import { join } from 'node:path';
import { check, open, page as opened } from './browser.mjs';

const [address, token, shots] = process.argv.slice(2);
const problems = [];
const { context, close } = await open();
const page = await opened(context, address, problems);
try {
  await page.goto(`${address}/#/jobs`);
  const field = page.getByLabel('Token', { exact: true });
  await field.waitFor();
  for (const scheme of ['light', 'dark']) {
    await page.emulateMedia({ colorScheme: scheme });
    await page.screenshot({ path: join(shots, `login-${scheme}.png`) });
  }
  await field.fill('gable_0000');
  await page.getByRole('button', { name: 'Log in' }).click();
  await page.getByText('this token is not known').waitFor();
  check(!(await page.evaluate(() => sessionStorage.length + Number(localStorage.getItem('gable.token') !== null))), 'a wrong token is not kept');
  await field.fill(token);
  await page.getByRole('button', { name: 'Log in' }).click();
  await page.locator('.job .name a').first().click();
  await page.getByRole('heading', { name: 'Stages' }).waitFor();
  await page.locator('.grid [data-unit]').first().waitFor();
  for (const name of ['Cancel', 'Pause', 'Retry', 'Retry what failed', 'Set']) {
    check((await page.getByRole('button', { name, exact: true }).count()) === 0, `a viewer is not offered to ${name}`);
  }
  // Files and pictures are asked for with the token, too.
  await page.getByRole('link', { name: 'Open the city' }).click();
  await page.waitForFunction(() => Number(document.querySelector('.viewer canvas')?.dataset.buildings) > 0, null, { timeout: 90_000 });
  await page.goto(`${address}/#/submit`);
  await page.getByText('Your token may look only').waitFor();
  check(!page.url().includes(token), 'the token is in no address');
  await page.getByRole('button', { name: 'Log out' }).click();
  await field.waitFor();
  check(problems.length === 0, problems.join('\n'));
} catch (error) {
  await page.screenshot({ path: join(shots, 'failed-login.png') }).catch(() => {});
  console.error(error.stack, problems.join('\n'));
  process.exitCode = 1;
}
await close();
console.log('{}');
