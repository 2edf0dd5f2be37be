// The page of `pneuma scope` in Chromium: node scope.mjs ADDRESS SECONDS FOLDER
//
// Needs playwright-core (npm, `package.json` beside this file) and Debian's chromium; another
// browser's path may stand in PNEUMA_CHROMIUM. Fails with the first thing that is not as expected.
import assert from "node:assert/strict";
import { chromium } from "playwright-core";

const [address, seconds, folder] = process.argv.slice(2);
const browser = await chromium.launch({
  executablePath: process.env.PNEUMA_CHROMIUM || "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update", "--disable-sync"],
});
const errors = [];
async function open() {
  const page = await browser.newPage({ viewport: { width: 1400, height: 950 } });
  page.on("pageerror", (error) => errors.push(error.message));
  page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
  await page.goto(address);
  await page.waitForFunction(() => rows && rows.next > 500);
  return page;
}

// Rows on a page that do not follow each other.
const gaps = (page) => page.evaluate(() => {
  let found = 0;
  for (let row = rows.first + 1; row < rows.next; row += 1) if (rows.tickOf(row) !== rows.tickOf(row - 1) + hello.stride) found += 1;
  return found;
});
const shown = (page, name) => page.textContent(`b[data-signal="${name}"]`).then(Number);

const page = await open();
await page.waitForFunction(() => document.querySelector("#state").textContent.startsWith("idle"));

// A move by keyboard alone: the set point is a form.
await page.focus("#to");
await page.keyboard.type("60");
await page.keyboard.press("Enter");
await page.waitForFunction(() => document.querySelector("#state").textContent.startsWith("tracking"));
await page.waitForTimeout(2500);
assert.ok(Math.abs((await shown(page, "position")) - 60) < 0.1, `${await shown(page, "position")}`);
await page.screenshot({ path: `${folder}/time.png` });

// A trigger catches the next move and stands still.
await page.selectOption("#window", "2");
await page.selectOption("#trigger", "fall");
await page.selectOption("#trigger-signal", { label: "position (mm)" });
await page.fill("#trigger-level", "30");
await page.fill("#to", "0");
await page.click("#move button");
await page.waitForFunction(() => document.querySelector("#pause").getAttribute("aria-pressed") === "true");
const caught = await page.evaluate(() => rows.valueOf(0, rows.rowAt(cursors.a)));
assert.ok(Math.abs(caught - 30) < 1, `${caught}`);
await page.screenshot({ path: `${folder}/trigger.png` });
await page.selectOption("#trigger", "off");

// What is drawn holds every peak: of a window of two minutes, the extremes of its rows.
const peaks = await page.evaluate(() => {
  const to = rows.tickOf(rows.next - 1), from = rows.tickOf(rows.first);
  const drawn = extremes(6, from, to, 300);
  let low = Infinity, high = -Infinity;
  for (let row = rows.first; row < rows.next; row += 1) { low = Math.min(low, rows.valueOf(6, row)); high = Math.max(high, rows.valueOf(6, row)); }
  const numbers = (list) => [...list].filter((value) => !Number.isNaN(value));
  return [low, high, Math.min(...numbers(drawn.least)), Math.max(...numbers(drawn.greatest))];
});
assert.equal(peaks[2], peaks[0]);
assert.equal(peaks[3], peaks[1]);

// A sine's amplitude is read off the spectrum.
const sine = await page.evaluate(() => {
  const re = new Float64Array(4096), im = new Float64Array(4096);
  for (let i = 0; i < 4096; i += 1) re[i] = 3 * Math.sin((2 * Math.PI * 50 * i) / 4096) * (0.5 - 0.5 * Math.cos((2 * Math.PI * i) / 4096));
  fft(re, im);
  return (4 * Math.hypot(re[50], im[50])) / 4096;
});
assert.ok(Math.abs(sine - 3) < 1e-6, `${sine}`);
for (const view of ["xy", "spectrum"]) {
  await page.click(`#tab-${view}`);
  await page.waitForTimeout(300);
  await page.screenshot({ path: `${folder}/${view}.png` });
}
await page.click("#tab-time");

// A second page, and the first one anew; then for so long without a row that nobody noticed.
const second = await open();
await page.reload();
await page.waitForFunction(() => rows && rows.next > 500);
await page.waitForTimeout(1000 * Number(seconds));
for (const one of [page, second]) {
  assert.equal(await gaps(one), 0);
  assert.equal(await one.textContent("#losses"), "");
}
const kept = await second.evaluate(() => rows.next);
assert.ok(kept > 900 * Number(seconds), `${kept} rows`);

// Dark, and narrow.
await page.emulateMedia({ colorScheme: "dark" });
await page.setViewportSize({ width: 700, height: 900 });
await page.waitForTimeout(300);
await page.screenshot({ path: `${folder}/dark.png`, fullPage: true });
assert.deepEqual(errors, []);
console.log(`${kept} rows on the second page, none missing`);
await browser.close();
