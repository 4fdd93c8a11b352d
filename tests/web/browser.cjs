// Opens the page in a browser. Arguments: what to do there ("controls": use every control as a person would; "rate": count
// pictures at rest and in motion; "tokens": get in with one; "disks": compare the blur drawn with that of a light; "blur": measure it and compare with that of a wall; "map": a focus map; "odd": press
// everything in whatever order, argument: a seed; "restart": lensd goes and comes back under the open page), address, folder for screenshots, tokens.
// Prints one line of JSON with what was measured; what is not as promised ends it with an error. LENSD_WRITE_GOLDENS=1 writes anew where
// things stand on the page (golden-WIDTH.json), after somebody has looked at it.
"use strict";
const assert = require("node:assert");
const fs = require("node:fs");
const path = require("node:path");
const puppeteer = require("puppeteer-core");

const [what, address, folder, viewToken, moveToken] = process.argv.slice(2);
const patience = Number(process.env.LENSD_TEST_PATIENCE || 1);
const limit = 20000 * patience;
const measured = {};
const digits = (value) => Number(value.toPrecision(4));
const complaints = [];

const text = (page, id) => page.$eval(`#${id}`, (element) => element.textContent);
const until = (page, id, pattern) => page.waitForFunction(
  (name, source) => new RegExp(source).test(document.getElementById(name).textContent), { timeout: limit }, id, pattern.source);
const ask = (page, method, parameters) => page.evaluate((m, p) => call(m, p), method, parameters);
const axis = async (page, name) => (await ask(page, "Status", {})).lenses[0].axes.find((one) => one.axis === name);

/** Clicks in the middle of what is scrolled into sight: what lies below the bar with Stop counts as seen, but cannot be hit. */
async function press(page, selector) {
  await page.$eval(selector, (element) => element.scrollIntoView({ block: "center" }));
  await page.click(selector);
}

function listenTo(page) {
  page.on("console", (message) => { if (["error", "warn"].includes(message.type())) complaints.push(message.text()); });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("requestfailed", (request) => {
    if (!/ERR_ABORTED/.test(request.failure().errorText)) complaints.push(`${request.url()}: ${request.failure().errorText}`);
  });
}

async function open(browser) {
  const page = await browser.newPage();
  listenTo(page);
  await page.setViewport({ width: 1280, height: 900 });
  const began = Date.now();
  await page.goto(address);
  await until(page, "link", /^connected$/);
  await page.waitForFunction(() => document.getElementById("nopicture").hidden, { timeout: limit });
  measured.firstPictureMs = Date.now() - began;
  return page;
}

/** How often a second the screen shows another picture than before. */
const rate = (page, seconds) => page.evaluate(async (length) => {
  const small = document.createElement("canvas");
  let before = null, changes = 0;
  [small.width, small.height] = [64, 64];
  const pen = small.getContext("2d", { willReadFrequently: true }), end = performance.now() + 1000 * length;
  while (performance.now() < end) {
    pen.drawImage(document.getElementById("picture"), 0, 0, 64, 64);
    const now = pen.getImageData(0, 0, 64, 64).data.reduce((sum, value, at) => (sum * 31 + value * (at + 1)) % 4294967291, 7);
    if (before !== null && now !== before) ++changes;
    before = now;
    await new Promise((next) => requestAnimationFrame(next));
  }
  return changes / length;
}, seconds);

async function moveLens(page) {
  const before = (await axis(page, "focus")).position;
  await press(page, '[data-nearer="100"]');
  await page.waitForFunction(async (from) => (await call("Status")).lenses[0].axes[0].position !== from, { timeout: limit, polling: 100 }, before);
  const slider = await axis(page, "iris");
  await page.focus("#iris");
  for (let i = 0; i < 5; ++i) await page.keyboard.press("PageUp");
  await page.waitForFunction(async (from) => (await call("Status")).lenses[0].axes[1].position !== from, { timeout: limit, polling: 100 }, slider.position);
  assert.match(await page.$eval("#iris", (element) => element.getAttribute("aria-valuetext")), /^f\//);
  const exposed = (await ask(page, "GetExposure", {})).exposure.exposureMs;
  await page.focus("#exposure");
  await page.keyboard.press("PageDown");
  await page.waitForFunction(async (from) => (await call("GetExposure")).exposure.exposureMs < from, { timeout: limit, polling: 100 }, exposed);
  assert.match(await page.$eval("#exposure", (element) => element.getAttribute("aria-valuetext")), /s$/);
  await ask(page, "SetExposure", { exposureMs: exposed });
  await page.focus("#focus");
  await page.keyboard.press("Home");
  await page.waitForFunction(async () => !(await call("Status")).lenses[0].axes[0].moving, { timeout: limit, polling: 100 });
  await press(page, "h1");
  const far = (await axis(page, "focus")).position;
  await page.keyboard.press("n");
  await page.waitForFunction(async (from) => (await call("Status")).lenses[0].axes[0].position !== from, { timeout: limit, polling: 100 }, far);
  assert.match(await text(page, "bounds"), /sharp to .* hyperfocal .* position/);
}

async function stopLens(page) {
  const ends = await page.evaluate(() => [axisInfo("focus").maximum, axisInfo("focus").minimum]);
  for (const stop of [() => press(page, "#stop"), () => page.keyboard.press("Escape")]) {
    const ended = [];  // a stop that a busy browser sends too late finds the lens arrived
    while (!ended.includes("Cancelled") && ended.length < 4) {
      const moving = page.evaluate((to) => call("Move", { axis: "focus", target: { position: to } }).then(() => "arrived", (why) => why.error), ends[ended.length % 2]);
      await Promise.race([moving, page.waitForFunction(async () => (await call("Status")).lenses[0].axes[0].moving, { timeout: limit, polling: 20 })]);
      await stop();
      ended.push(await moving);
    }
    assert.equal(ended.at(-1), "Cancelled", ended.join(", "));
  }
}

async function findFocus(page) {
  const box = await (await page.$("#overlay")).boundingBox();
  await page.mouse.click(box.x + box.width * 0.5, box.y + box.height * 0.5);
  await until(page, "found", /Searching/);
  measured.rateInAutofocus = await rate(page, 2);
  await until(page, "found", /^(Focused at|Refused|Ended)/);
  assert.match(await text(page, "found"), /^Focused at .* frames/);
  assert.ok(await page.$("#curve canvas"), "the curve is drawn");
  await press(page, "#find");
  await until(page, "found", /^(Searching)/);
  await until(page, "found", /^(Focused at|Refused)/);
  await page.evaluate(() => { call("Autofocus", { method: "sweep" }); });  // as another client would
  await until(page, "found", /^Somebody else/);
  await until(page, "found", /^(Focused at|Refused)/);
  await findByKeys(page);
}

/** Without a mouse: a box is moved over the picture, and what it holds is brought into focus and kept there until Stop. */
async function findByKeys(page) {
  await press(page, 'input[value="track"]');
  await page.focus("#overlay");
  for (const key of ["ArrowLeft", "ArrowDown", "+", "-"]) await page.keyboard.press(key);
  assert.match(await text(page, "boxtext"), /^box 20 % wide, its middle at 4\d % from the left and 5\d % from the top$/);
  await page.keyboard.press("Enter");
  await until(page, "found", /^Keeping it in focus/);
  await until(page, "found", /^Keeping it in focus until Stop\. Focused at/);
  await press(page, "#stop");
  await until(page, "found", /^Ended/);
  assert.equal(await text(page, "note"), "", "who stops is not told that it stopped");
  await press(page, 'input[value="focus"]');
}

async function dragLimit(page) {
  await press(page, "#add-sharp");
  await until(page, "verdict", /^f\//);
  await press(page, "#add-blurred");
  await page.waitForFunction(() => document.querySelectorAll("#limits li").length === 2);
  await page.waitForFunction(() => plan.answer !== null, { timeout: limit });
  const before = await text(page, "verdict");
  await page.$eval("#axis", (element) => element.scrollIntoView({ block: "center" }));
  const handle = await page.$('[data-handle="sharp-1-nearD"]'), at = await handle.boundingBox();
  await page.mouse.move(at.x + at.width / 2, at.y + at.height / 2);
  await page.mouse.down();
  await page.evaluate(() => { window.asked = []; const first = call; call = (...all) => { const began = performance.now();
    return first(...all).finally(() => { if (all[0] === "Plan") window.asked.push(performance.now() - began); }); }; });
  for (let step = 1; step <= 15; ++step) await page.mouse.move(at.x + at.width / 2 + 4 * step, at.y + at.height / 2);
  await page.mouse.up();
  await page.waitForFunction((old) => document.getElementById("verdict").textContent !== old, { timeout: limit }, before);
  measured.planMs = (await page.evaluate(() => window.asked)).sort((a, b) => a - b);
  assert.ok(measured.planMs.length > 0);
  const dragged = await page.evaluate(() => plan.limits[0].nearD);
  await page.$eval('[data-handle="sharp-1-nearD"]', (element) => element.focus());
  await page.keyboard.press("ArrowLeft");
  await page.waitForFunction((old) => plan.limits[0].nearD < old, { timeout: limit }, dragged);
  assert.equal(await page.evaluate(() => document.activeElement.dataset.handle), "sharp-1-nearD", "the handle keeps the focus");
  assert.ok(await page.$eval("#region", (canvas) => canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.some((value) => value)));
}

async function applyPlan(page) {
  // What cannot be is said in words; then the blurred limit goes, and the rest is applied.
  await page.evaluate(() => { plan.limits[1].farD = plan.limits[0].farD; plan.limits[1].nearD = plan.limits[0].nearD; planChanged(); });
  await until(page, "verdict", /^No setting meets all of this: .* contradict each other/);
  assert.ok(await page.$eval("#apply", (button) => button.disabled));
  await press(page, '[aria-label="Remove blurred-2"]');
  await page.waitForFunction(() => !document.getElementById("apply").disabled, { timeout: limit });
  await press(page, '[aria-label="Show where sharp-1 is in the picture"]');
  const box = await (await page.$("#overlay")).boundingBox();
  await page.mouse.click(box.x + box.width * 0.42, box.y + box.height * 0.52);  // the engine
  await page.waitForFunction(() => plan.limits[0].place, { timeout: limit });
  await press(page, "#apply");
  await until(page, "verdict", /(Applied|Not reached)/);
  assert.match(await text(page, "verdict"), /Applied; where the motors stand the tightest limit is used to \d+ %/);
  await until(page, "verdict", /Blur measured beside planned/);
  assert.match(await text(page, "limits"), /measured (\S+ ± \S+ px|too little to be seen there), planned \S+( to \S+)? px/);
  measured.blur = (await text(page, "limits")).match(/measured .* px/)[0];
}

/** The page's upper part, held against docs/images/live-page.jpg, which README shows: as 32 by 20 fields, each of which may differ
 * by letters and readings. LENSD_WRITE_GOLDENS writes it anew. */
async function portrait(page) {
  const file = path.join(__dirname, "..", "..", "docs", "images", "live-page.jpg");
  await page.setViewport({ width: 1280, height: 900 });
  await page.evaluate(() => scrollTo(0, 0));
  const { exposureMs } = (await ask(page, "GetExposure", {})).exposure;
  await ask(page, "SetExposure", { exposureMs: 4 });
  await page.waitForFunction(() => document.getElementById("nopicture").hidden && / 4 ms · f\/1\.\d+ · sharpness/.test(document.getElementById("frametext").textContent),
                             { timeout: limit });
  const seen = await page.screenshot({ type: "jpeg", quality: 80, encoding: "base64" });
  await ask(page, "SetExposure", { exposureMs });
  if (process.env.LENSD_WRITE_GOLDENS) return fs.writeFileSync(file, Buffer.from(seen, "base64"));
  const coarse = (picture) => page.evaluate(async (data) => {
    const image = new Image();
    image.src = `data:image/jpeg;base64,${data}`;
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height), pen = canvas.getContext("2d");
    pen.drawImage(image, 0, 0);
    const { data: bytes } = pen.getImageData(0, 0, image.width, image.height), fields = new Float64Array(32 * 20);
    for (let y = 0; y < image.height; ++y) {
      for (let x = 0; x < image.width; ++x) {
        fields[Math.floor(y * 20 / image.height) * 32 + Math.floor(x * 32 / image.width)] += bytes[4 * (y * image.width + x)];
      }
    }
    return [...fields].map((sum) => sum * fields.length / (image.width * image.height));
  }, picture);
  const [shown, promised] = [await coarse(seen), await coarse(fs.readFileSync(file).toString("base64"))];
  const mean = shown.reduce((sum, value, at) => sum + Math.abs(value - promised[at]), 0) / shown.length;
  measured.besideReadme = mean;
  assert.ok(mean < 12, `docs/images/live-page.jpg shows another page (differs by ${mean} of 255); LENSD_WRITE_GOLDENS=1 writes it anew`);
}

/** A stack of what must be sharp, as a strip of pictures. */
async function takeStack(page) {
  await page.evaluate(() => { Object.assign(plan.limits[0], { farD: 0.2, nearD: 0.6, limitPx: 0.4 }); planChanged(); });
  await page.waitForFunction(() => !document.getElementById("stack").disabled, { timeout: limit });
  await press(page, "#stack");
  await until(page, "stacked", /shots? (together )?keeps? all of it sharp/);
  const shots = await page.$$eval("#shots img", async (all) => { await Promise.all(all.map((one) => one.decode())); return all.map((one) => [one.alt, one.naturalWidth]); });
  const planned = (await ask(page, "Plan", { request: { limits: await page.evaluate(() => planRequest().limits), stack: true } })).plan.shots;
  assert.equal(shots.length, planned.length);
  assert.ok(shots.length > 1, "one setting does not do");
  for (const [alt, width] of shots) assert.ok(/^Shot \d+ of \d+, sharp from .* to /.test(alt) && width > 100, alt);
  measured.shots = shots.length;
  await page.evaluate(() => { Object.assign(plan.limits[0], { farD: 0.4, nearD: 0.45, limitPx: 2 }); planChanged(); clearStrip(); byId("stacked").textContent = ""; });
}

async function enlarge(page) {
  await press(page, "#peaking");
  await press(page, "#disks");
  await press(page, 'input[value="zoom"]');
  await page.$eval("#overlay", (element) => element.scrollIntoView({ block: "center" }));
  const box = await (await page.$("#overlay")).boundingBox();
  await page.mouse.move(box.x + box.width * 0.3, box.y + box.height * 0.3);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.6, box.y + box.height * 0.6, { steps: 4 });
  await page.mouse.up();
  await page.waitForFunction(() => view.last?.picture.leftPx > 0, { timeout: limit });
  await page.waitForFunction(() => document.getElementById("overlay").getContext("2d").getImageData(0, 0, 9999, 9999).data.some((value) => value), { timeout: limit });
  await press(page, "#whole");
  await page.waitForFunction(() => view.last?.picture.leftPx === 0, { timeout: limit });
  await press(page, 'input[value="focus"]');
  assert.match(await text(page, "clipping"), /%/);
}

async function overview(page) {
  assert.match(await text(page, "lenses"), /free/);
  await page.waitForFunction(() => document.querySelectorAll("#events li").length > 3, { timeout: limit });
  const told = await text(page, "events");
  assert.match(told, /focus reached/);
  assert.match(told, /autofocus: /);
  assert.match(await text(page, "lenses"), /\d+ moves?.*, \d+ searches/);
  const named = await page.$$eval("button, input, select, [role=slider]", (all) => all.filter((one) => !one.closest("[hidden]")).map((one) =>
    one.textContent.trim() || one.getAttribute("aria-label") || one.ariaLabel || [...(one.labels ?? [])].map((label) => label.textContent).join()));
  assert.ok(named.every((name) => name.trim()), `every control has a name: ${named}`);
}

/** Whatever has a name in the page and is seen: in reading order, within what, from where to where across the page. Heights
 * go by what the lens has done; what not every lensd has does not count. */
const structure = (page) => page.evaluate(() => [...document.querySelectorAll("body [id]")]
  .filter((one) => !one.closest("svg, .u-wrap, [data-feature]") && one.tagName !== "TEMPLATE" && one.getClientRects().length > 0)
  .map((one) => {
    const box = one.getBoundingClientRect();
    return { id: one.id, within: one.parentElement.closest("[id]")?.id ?? null, left: Math.round(box.left), right: Math.round(box.right) };
  }));

/** Held against golden-WIDTH.json by one edge at least: what is written differs in length, and letters from machine to machine. */
async function holdAgainstGolden(page, width) {
  const seen = await structure(page), file = path.join(__dirname, `golden-${width}.json`);
  if (process.env.LENSD_WRITE_GOLDENS) {
    fs.writeFileSync(file, `[\n${seen.map((one) => "  " + JSON.stringify(one)).join(",\n")}\n]\n`);
    return;
  }
  const golden = JSON.parse(fs.readFileSync(file));
  const names = (all) => all.map((one) => `${one.within ?? ""}/${one.id}`);
  assert.deepEqual(names(seen), names(golden), `what is on the page at ${width}, in its order`);
  const apart = (edge) => (one, at) => Math.abs(one[edge] - golden[at][edge]) > 16;
  const moved = seen.filter((one, at) => apart("left")(one, at) && apart("right")(one, at));
  assert.deepEqual(moved.map((one) => one.id), [], `stands elsewhere at ${width}`);
  measured[`inPlaceAt${width}`] = seen.length;
}

/** Text whose colour does not stand out from what is behind it (WCAG 2.1, 1.4.3: 4.5 to 1, 3 to 1 for large letters). */
const faintTexts = (page) => page.evaluate(() => {
  const pen = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (colour) => {
    pen.clearRect(0, 0, 1, 1);
    pen.fillStyle = colour;
    pen.fillRect(0, 0, 1, 1);
    return [...pen.getImageData(0, 0, 1, 1).data];
  };
  const light = (colour) => colour.slice(0, 3).map((value) => value / 255)
    .map((value) => value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4)
    .reduce((sum, value, at) => sum + value * [0.2126, 0.7152, 0.0722][at], 0);
  const behind = (one) => {
    for (let at = one; at; at = at.parentElement) {
      const colour = rgba(getComputedStyle(at).backgroundColor);
      if (colour[3] === 255) return colour;
    }
    return [255, 255, 255, 255];
  };
  const written = [...document.querySelectorAll("body *")].filter((one) => !one.closest("svg") && one.getClientRects().length > 0 &&
    !one.disabled && !one.closest(":disabled") && [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim()));
  return [written.length, written.filter((one) => {
    const style = getComputedStyle(one), [a, b] = [light(rgba(style.color)), light(behind(one))].sort((x, y) => y - x);
    return (a + 0.05) / (b + 0.05) < (parseFloat(style.fontSize) >= 24 ? 3 : 4.5);
  }).map((one) => `${one.id || one.tagName}: ${one.textContent.trim().slice(0, 30)}`)];
});

/** At each width and in both colours: everything in its place, nothing beyond the edge, every letter readable, Stop in sight;
 * pictures of it. */
async function look(page) {
  for (const width of [1280, 400]) {
    for (const scheme of ["light", "dark"]) {
      await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
      await page.setViewport({ width, height: 900 });
      await page.waitForFunction((wide) => innerWidth === wide, { timeout: limit }, width);
      await page.waitForFunction(() => document.getElementById("nopicture").hidden, { timeout: limit });
      await new Promise((done) => setTimeout(done, 500));
      const beyond = await page.evaluate(() => [...document.querySelectorAll("main *")].filter((one) => !one.closest(".scroll") &&
        !one.closest("svg") && one.getBoundingClientRect().right > innerWidth + 1).map((one) => one.id || one.tagName));
      assert.deepEqual(beyond, [], `at ${width}`);
      assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), width);
      await holdAgainstGolden(page, width);
      const [written, faint] = await faintTexts(page);
      assert.equal(faint.join("\n"), "", `hard to read in ${scheme}`);
      measured[`readableIn${scheme}At${width}`] = written;
      await page.evaluate(() => scrollTo(0, 600));
      const stop = await page.$eval("#stop", (button) => button.getBoundingClientRect().toJSON());
      assert.ok(stop.top >= 0 && stop.bottom <= 900 && stop.right <= width, "Stop is always in sight");
      await page.evaluate(() => scrollTo(0, 0));
      await page.screenshot({ path: path.join(folder, `page-${width}-${scheme}.png`), fullPage: true });
    }
  }
}

/** Pictures a second while the lens stands, and while it moves to and fro. */
async function rates(browser) {
  const page = await open(browser);
  measured.rateAtRest = await rate(page, 4);
  await page.evaluate(() => { window.going = (async () => {
    for (let there = 0; there < 6; ++there) {
      const { minimum, maximum } = axisInfo("focus");
      await call("Move", { axis: "focus", target: { position: there % 2 ? minimum : maximum } }).catch(() => {});
    }
  })(); });
  measured.rateInMotion = await rate(page, 3);
  await press(page, "#stop");
  // What these prepared frames show does not hang on focus: each search is refused, after some seconds.
  await page.evaluate(() => { window.searching = (async () => {
    for (let i = 0; i < 20 && !window.seenEnough; ++i) await callMore("Autofocus", { lens: house.name, method: "sweep" }, () => {}).catch(() => {});
  })(); });
  await page.waitForFunction(async () => (await call("Status")).lenses[0].activity === "autofocus", { timeout: limit, polling: 50 });
  measured.rateInAutofocus = await rate(page, 3);
  await page.evaluate(() => { window.seenEnough = true; });
  await press(page, "#stop");
  await page.evaluate(() => window.searching);
}

/** Without a token, with a wrong one, with one for looking on, and with one in the address, which must not stay there. */
async function tokens(browser) {
  const page = await browser.newPage();
  await page.goto(address);
  await page.waitForFunction(() => !document.getElementById("login").hidden, { timeout: limit });
  await page.type("#token", "nonsense");
  await press(page, "#login button");
  await until(page, "note", /not known/);
  await page.$eval("#token", (field) => { field.value = ""; });
  await page.type("#token", viewToken);
  await press(page, "#login button");
  await until(page, "link", /^connected, to look on$/);
  await page.waitForFunction(() => document.getElementById("nopicture").hidden, { timeout: limit });
  assert.ok(await page.$eval("#focus", (slider) => slider.disabled) && await page.$eval("#find", (button) => button.disabled));
  assert.ok(!await page.$eval("#stop", (button) => button.disabled));
  await press(page, "#stop");
  assert.equal(await text(page, "note"), "");
  assert.equal(await page.evaluate(() => document.cookie), "", "no script can read the token");
  await page.goto("about:blank");
  await page.goto(`${address}#token=${moveToken}`);
  await until(page, "link", /^connected$/);
  await page.waitForFunction(() => !document.getElementById("focus").disabled, { timeout: limit });
  assert.ok(!page.url().includes(moveToken));
}

/** The blur that the page draws for a depth is that of a point of light there, in the pixels of the camera. */
async function disks(browser) {
  const page = await open(browser);
  measured.disks = [];
  for (const [vergenceD, fNumber] of [[0.9, 2], [0.6, 2], [0.1, 2], [0.6, 4]]) {
    await ask(page, "Move", { axis: "focus", target: { vergenceD } });
    await ask(page, "Move", { axis: "iris", target: { fNumber } });
    const [seen, drawn] = await page.evaluate(async () => {
      const abort = new AbortController();
      const answer = await fetch("/live.mjpg?encoding=gray8", { signal: abort.signal });
      let pixels = null;
      for await (const part of partsOf(answer.body)) { pixels = part.bytes; break; }
      abort.abort();
      const half = Math.max(...[...new Set(pixels)]) / 2;
      const area = pixels.reduce((count, value) => count + (value > half), 0);
      const state = (await call("Status")).lenses[0];
      const um = optics.blurUm(state.focalLengthMm, state.fNumber, state.extensionMm, 1 / 3);
      return [2 * Math.sqrt(area / Math.PI), Math.abs(um) / pixelUm()];
    });
    measured.disks.push([seen, drawn]);
    assert.ok(Math.abs(seen - drawn) <= 1, `focused at ${vergenceD} D, f/${fNumber}: ${seen} px seen, ${drawn} px drawn`);
  }
}

/** The blur that the page measures in the picture of a wall 2 m away, beside what the geometry of lens and wall says. */
async function blur(browser) {
  const page = await open(browser);
  measured.blur = [];
  for (const [vergenceD, fNumber] of [[0.5, 2], [0.6, 2], [0.75, 2], [1.1, 2], [0.3, 2.8], [0.8, 4]]) {
    await ask(page, "Move", { axis: "focus", target: { vergenceD } });
    await ask(page, "Move", { axis: "iris", target: { fNumber } });
    const exposure = (await ask(page, "GetExposure", {})).exposure.exposureMs, iris = (await axis(page, "iris")).position;
    const truth = await ask(page, "io.lensd.Simulator.Truth", { lens: "a" });
    const seen = await page.evaluate(async () => {
      const state = (await call("Status")).lenses[0];
      house.states.set(state.name, state);
      plan.limits = [{ name: "wall", kind: "sharp", farD: 0.5, nearD: 0.5, limitPx: 9, place: { x: 0.2, y: 0.2, w: 0.6, h: 0.6 } }];
      await measureBlur();
      return { ...plan.limits[0].measured, done: plan.done };
    });
    const image = 1 / (1 / 25 - 1 / 2000), stands = 25 + truth.extensionMm;
    const px = 25 / truth.fNumber * Math.abs(stands / image - 1) * 1000 / 5;
    measured.blur.push([digits(px), seen.px, seen.sigmaPx]);
    assert.match(seen.done, /measured beside planned/);
    assert.ok(px < 1.5 ? seen.px < 2 : Math.abs(seen.px - px) <= 0.3 + 0.07 * px, `focused at ${vergenceD} D, f/${fNumber}: ${seen.px} px measured, ${px} px are there`);
    assert.equal((await ask(page, "GetExposure", {})).exposure.exposureMs, exposure, "the exposure is back");
    assert.ok(Math.abs((await axis(page, "iris")).position - iris) <= 1, "the aperture is back");
  }
}

/** Where each part of the picture is in focus, as the page tells those who do not see it. */
async function map(browser) {
  const page = await open(browser);
  await press(page, "#map");
  const told = await page.waitForFunction(() => {
    const mapped = document.getElementById("focusmap").getAttribute("aria-label");
    return !document.getElementById("mapped").hidden && /parts/.test(mapped) && mapped;
  }, { timeout: 3 * limit });
  const [, found, all, near, far] = (await told.jsonValue()).match(/(\d+) of (\d+) parts are known, in focus from ([\d.]+) mm to ([\d.]+) mm/).map(Number);
  Object.assign(measured, { parts: [found, all], mm: [near, far] });
  await (await page.$("#mapped")).screenshot({ path: path.join(folder, "map.png") });
}

/** Presses whatever can be pressed in an order that nobody would choose. Nothing may break, and Stop still stops. */
async function odd(browser) {
  const page = await browser.newPage();
  listenTo(page);
  await page.setViewport({ width: 1280, height: 900 });
  await page.goto(address);
  await until(page, "link", /^connected$/);
  let seed = Number(viewToken);
  const chance = (most) => { seed = (seed * 1103515245 + 12345) % 2147483648; return Math.floor(seed / 2147483648 * most); };
  for (let i = 0; i < 60; ++i) {
    const told = await page.evaluate((which, what) => {
      const all = [...document.querySelectorAll("button, input, select, canvas#overlay, [role=slider]")].filter((one) => !one.disabled && one.getClientRects().length > 0);
      const one = all[Math.floor(which * all.length)];
      if (one.type === "range") {
        one.value = Number(one.min) + what * (Number(one.max) - Number(one.min));
        one.dispatchEvent(new Event("input"));
      } else if (one.type === "number") {
        one.value = ["", "-3", "0", "1e9", "2.5"][Math.floor(what * 5)];
        one.dispatchEvent(new Event("input"));
        one.dispatchEvent(new Event("change"));
      } else if (one.tagName === "SELECT") {
        one.selectedIndex = Math.floor(what * one.options.length);
        one.dispatchEvent(new Event("change"));
      } else if (one.id === "overlay" || one.role === "slider") {
        one.focus();
        for (const key of ["ArrowLeft", "ArrowUp", "PageDown", "Enter"]) one.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
      } else one.click();
      return one.id || one.textContent || one.ariaLabel;
    }, chance(1000) / 1000, chance(1000) / 1000);
    (measured.pressed ??= []).push(told);
    await new Promise((done) => setTimeout(done, chance(250)));
  }
  await press(page, "#stop");
  await page.waitForFunction(async () => (await call("Status")).lenses.every((lens) => lens.activity === "idle" || !lens.connected), { timeout: limit, polling: 100 });
  await page.waitForFunction(() => !plan.busy, { timeout: limit });
  const said = await page.evaluate(() => document.body.innerText);
  assert.ok(!/undefined|NaN|null|\[object|TypeError|Failed to fetch/.test(said), said);
  measured.pressed = measured.pressed.length;
}

/** lensd goes, is missed, comes back. */
async function restart(browser) {
  const page = await open(browser);
  console.error("open");  // now lensd may go
  await until(page, "link", /^lensd is away: /);
  await page.waitForFunction(() => !document.getElementById("nopicture").hidden, { timeout: limit });
  await page.waitForFunction(() => /lensd is away/.test(document.getElementById("lenses").textContent), { timeout: limit });
  await press(page, '[data-nearer="10"]');
  await page.waitForFunction(() => !document.getElementById("note").hidden, { timeout: limit });
  assert.match(await text(page, "note"), /lensd/);
  console.error("missed");  // now it may come back
  await until(page, "link", /^connected$/);
  await page.waitForFunction(() => document.getElementById("nopicture").hidden, { timeout: limit });
  const before = (await axis(page, "focus")).position;
  await press(page, '[data-nearer="100"]');
  await page.waitForFunction(async (from) => (await call("Status")).lenses[0].axes[0].position !== from, { timeout: limit, polling: 100 }, before);
  assert.equal(await text(page, "note"), "");
}

async function controls(browser) {
  const page = await open(browser);
  measured.rateAtRest = await rate(page, 2);
  for (const step of [moveLens, stopLens, findFocus, dragLimit, applyPlan, portrait, takeStack, enlarge, overview, look]) {
    const began = Date.now();
    try {
      await step(page);
    } catch (failure) {
      await page.screenshot({ path: path.join(folder, "failed.png"), fullPage: true }).catch(() => {});
      console.error(`${step.name}: note "${await text(page, "note")}", found "${await text(page, "found")}", verdict "${await text(page, "verdict")}"`);
      throw failure;
    }
    measured[`${step.name}Ms`] = Date.now() - began;
  }
}

async function main() {
  const browser = await puppeteer.launch({ executablePath: process.env.CHROMIUM || "/usr/bin/chromium", headless: true,
    args: ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"], protocolTimeout: 4 * limit });
  try {
    await { controls, rate: rates, tokens, disks, blur, map, odd, restart }[what](browser);
    assert.equal(complaints.join("\n"), "", "the console is quiet");
    console.log(JSON.stringify(measured));
  } finally {
    await browser.close();
  }
}

main().catch((failure) => { console.error(failure); process.exit(1); });
