// The page of lens-web. It speaks the interface io.lensd.Lens by POST /call/METHOD; pictures and events come as streams.
"use strict";

const byId = (id) => document.getElementById(id);
const house = { lenses: new Map(), states: new Map(), name: null, features: [], role: "none", connected: false, stoppedMs: -Infinity, past: [] };

// ---- Talking to lensd -------------------------------------------------------------------------------------------------

async function call(method, parameters = {}, options = {}) {
  const answer = await fetch(`/call/${method}?errors=body`, {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(parameters), ...options });
  const body = await answer.json();
  if (!body.error) return body;
  throw failureOf(body);
}

function failureOf(body) {
  const failure = new Error(body.parameters?.message ?? body.error);
  failure.error = body.error.split(".").pop();
  if (failure.error === "NoToken") askForToken();
  return failure;
}

/** A call with several answers: `told` gets each. Resolves with the last one. */
async function callMore(method, parameters, told, signal) {
  const answer = await fetch(`/call/${method}?errors=body`, {
    method: "POST", headers: { "Content-Type": "application/json", Accept: "text/event-stream" },
    body: JSON.stringify(parameters), signal });
  if (answer.headers.get("Content-Type") !== "text/event-stream") {
    throw failureOf(await answer.json());
  }
  const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "", last = null;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return last;
    text += value;
    const events = text.split("\n\n");
    text = events.pop();
    for (const event of events) {
      const data = event.split("\n").find((line) => line.startsWith("data: "));
      if (!data) continue;
      last = JSON.parse(data.slice(6));
      if (event.startsWith("event: error")) throw failureOf(last);
      told(last);
    }
  }
}

function note(text) {
  byId("note").textContent = text ?? "";
  byId("note").hidden = !text;
}

/** What a screen reader is to say when it has changed, and only then. */
function tell(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

/** What went wrong, for people: fetch() itself says no more than that it failed. */
const wordsOf = (failure) => failure instanceof TypeError && /fetch|network/i.test(failure.message)
  ? "lens-web does not answer; is it running?" : failure.message;

/** Whether it is nobody's fault: displaced moves, and what one has just stopped oneself. */
const expected = (failure) => failure.error === "Superseded" || failure.name === "AbortError" ||
  (failure.error === "Cancelled" && performance.now() - house.stoppedMs < 3000);

/** Runs what a control asks for; what goes wrong is told. */
async function attempt(work) {
  try {
    note(null);
    await work();
  } catch (failure) {
    if (!expected(failure)) note(wordsOf(failure));
  }
}

// ---- Words and optics -------------------------------------------------------------------------------------------------

const digits = (value, count = 4) => Number(value.toPrecision(count)).toString();

function distanceText(vergenceD, count = 4) {
  if (vergenceD == null) return "unknown";
  if (vergenceD < -1e-4) return `${digits(vergenceD, 3)} D, past infinity`;
  if (vergenceD < 1e-4) return "infinity";
  const metres = 1 / vergenceD;
  return metres < 1 ? `${digits(metres * 1000, count)} mm` : `${digits(metres, count)} m`;
}

const lensInfo = () => house.lenses.get(house.name);
const lensState = () => house.states.get(house.name);
const axisInfo = (axis) => lensInfo()?.axes.find((one) => one.axis === axis);
const pixelUm = () => lensInfo()?.camera?.pixelUm ?? null;
const limitUm = () => (pixelUm() ?? 1) * Math.max(0.1, Number(byId("limit").value) || 1);

function focalMm() {
  return lensState()?.focalLengthMm ?? lensInfo()?.optics?.focalLengthMm ?? null;
}

/** The thin lens: millimetres in, dioptres and micrometres out. */
const optics = {
  vergence: (f, e) => 1000 * e / (f * (f + e)),
  extension: (f, u) => f * f * u / (1000 - f * u),
  /** Signed: positive behind the plane in focus. */
  blurUm: (f, n, e, u) => 1000 * (f / n) * ((f + e) * (1 / f - u / 1000) - 1),
  /** The vergences at which the blur is `um`: [near, far]. */
  depthOfField(f, n, e, um) {
    const part = um / 1000 / (f / n);
    return [1000 * (1 / f - (1 - part) / (f + e)), 1000 * (1 / f - (1 + part) / (f + e))];
  },
  hyperfocalD: (f, n, um) => 1000 / (f + f * f / (n * um / 1000)),
};

function vergenceRange() {
  const known = lensInfo()?.optics;
  if (!known) return null;
  const f = known.focalLengthMm;
  return [optics.vergence(f, known.extensionMinMm), optics.vergence(f, known.extensionMaxMm)];
}

// ---- A scale of distances, linear in vergence -------------------------------------------------------------------------

const SVG = "http://www.w3.org/2000/svg";
function shape(parent, kind, attributes, text) {
  const made = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text != null) made.textContent = text;
  parent.append(made);
  return made;
}

/** Where a vergence is drawn, far on the left. */
function scaleOf(svg, low, high) {
  const width = svg.clientWidth || 300, margin = 10;
  return {
    width,
    x: (u) => margin + (Math.min(Math.max(u, low), high) - low) / (high - low) * (width - 2 * margin),
    vergence: (x) => low + Math.min(Math.max((x - margin) / (width - 2 * margin), 0), 1) * (high - low),
  };
}

function drawTicks(svg, scale, low, high, y) {
  let last = -100;
  const metres = [Infinity, 100, 50, 20, 10, 7, 5, 4, 3, 2.5, 2, 1.7, 1.5, 1.2, 1, 0.8, 0.7, 0.6, 0.5, 0.4, 0.35, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05];
  for (const distance of metres) {
    const u = 1 / distance;
    if (u < low - 1e-9 || u > high) continue;
    const x = scale.x(u);
    if (x - last < 38) continue;
    last = x;
    shape(svg, "line", { class: "tick", x1: x, x2: x, y1: y - 5, y2: y });
    shape(svg, "text", { class: "text", x, y: y + 12, "text-anchor": "middle" }, distance === Infinity ? "∞" : `${distance} m`);
  }
}

/** Drawn anew only where something of it has changed: a moving lens tells its state twenty times a second. */
function drawScale() {
  const svg = byId("scale"), range = vergenceRange(), state = lensState();
  const drawn = JSON.stringify([house.name, range, state?.extensionMm, state?.fNumber, state?.vergenceD, focalMm(), limitUm(), innerWidth, state && axisInfo("focus") && boundText()]);
  if (svg.dataset.drawn === drawn) return;
  svg.dataset.drawn = drawn;
  svg.replaceChildren();
  svg.toggleAttribute("hidden", !range);
  document.querySelector(".sharp-means").hidden = !range;
  if (!range && state && axisInfo("focus")) byId("bounds").textContent = boundText().replace("; ", "");
  if (!range || !state) return;
  const [low, high] = range, scale = scaleOf(svg, low, high), f = focalMm();
  if (state.extensionMm != null && state.fNumber != null && f) {
    const [near, far] = optics.depthOfField(f, state.fNumber, state.extensionMm, limitUm());
    shape(svg, "rect", { class: "dof", x: scale.x(far), width: Math.max(1, scale.x(near) - scale.x(far)), y: 2, height: 24 });
    const hyperfocal = optics.hyperfocalD(f, state.fNumber, limitUm());
    if (hyperfocal <= high) {
      shape(svg, "line", { class: "mark", x1: scale.x(hyperfocal), x2: scale.x(hyperfocal), y1: 4, y2: 26 });
      shape(svg, "title", {}, `hyperfocal ${distanceText(hyperfocal)}`);
    }
    byId("bounds").textContent = `sharp to ${byId("limit").value} px from ${distanceText(near)} to ${distanceText(Math.max(0, far))}` +
      `; hyperfocal ${distanceText(hyperfocal)}` + boundText();
  }
  if (low <= 0 && high >= 0) shape(svg, "line", { class: "tick", x1: scale.x(0), x2: scale.x(0), y1: 2, y2: 26 });
  if (state.vergenceD != null) shape(svg, "line", { class: "now", x1: scale.x(state.vergenceD), x2: scale.x(state.vergenceD), y1: 0, y2: 28 });
  drawTicks(svg, scale, low, high, 28);
}

function boundText() {
  const focus = lensState().axes.find((axis) => axis.axis === "focus");
  if (focus?.positionBound == null) return "";
  return `; position ${digits(focus.position)} ± ${digits(focus.positionBound, 2)} ${axisInfo("focus").unit}`;
}

// ---- Moving -----------------------------------------------------------------------------------------------------------

/** Of wishes that come faster than they can be asked for only the newest counts. */
function newestOnly(ask) {
  let waiting = null, under = false;
  return async function wish(value) {
    waiting = { value };
    if (under) return;
    under = true;
    try {
      while (waiting) {
        const next = waiting.value;
        waiting = null;
        await ask(next);
      }
    } finally {
      under = false;
    }
  };
}

const move = (axis, target, more = {}) => attempt(() => call("Move", { lens: house.name, axis, target, ...more }));
const pause = (ms) => new Promise((done) => setTimeout(done, ms));
/** Begins a move at most every 60 ms, and does not wait for its end: the newest command takes the axis over. */
const steer = newestOnly(async ([axis, target]) => { move(axis, target); await pause(60); });

function stop() {
  house.stoppedMs = performance.now();
  return attempt(() => call("Stop", house.name ? { lens: house.name } : {}, { keepalive: true, priority: "high" }));
}

const sliders = {
  focus: {
    setUp(slider) {
      const range = vergenceRange(), axis = axisInfo("focus");
      [slider.min, slider.max] = range ?? [axis.minimum, axis.maximum];
      slider.step = (slider.max - slider.min) / 2000;
    },
    value: (state) => vergenceRange() ? state.vergenceD : axisOf(state, "focus").position,
    text: (value) => vergenceRange() ? `${distanceText(value)} (${digits(value, 3)} D)` : `${digits(value)} ${axisInfo("focus").unit}`,
    target: (value) => vergenceRange() ? { vergenceD: value } : { position: value },
  },
  iris: {
    setUp(slider) {
      const known = lensInfo().optics, axis = axisInfo("iris");
      [slider.min, slider.max] = known ? [Math.log2(known.fNumberMin), Math.log2(known.fNumberMax)] : [axis.minimum, axis.maximum];
      slider.step = (slider.max - slider.min) / 500;
    },
    value: (state) => lensInfo().optics && state.fNumber ? Math.log2(state.fNumber) : axisOf(state, "iris").position,
    text: (value) => lensInfo().optics ? `f/${digits(2 ** value, 3)}` : digits(value),
    target: (value) => {
      const known = lensInfo().optics;
      return known ? { fNumber: Math.min(known.fNumberMax, Math.max(known.fNumberMin, 2 ** value)) } : { position: value };
    },
  },
  zoom: {
    setUp(slider) {
      const known = lensInfo().optics, axis = axisInfo("zoom");
      [slider.min, slider.max] = known?.focalLengthMaxMm ? [known.focalLengthMm, known.focalLengthMaxMm] : [axis.minimum, axis.maximum];
      slider.step = (slider.max - slider.min) / 500;
    },
    value: (state) => lensInfo().optics?.focalLengthMaxMm ? state.focalLengthMm : axisOf(state, "zoom").position,
    text: (value) => lensInfo().optics?.focalLengthMaxMm ? `${digits(value, 3)} mm` : digits(value),
    target: (value) => lensInfo().optics?.focalLengthMaxMm ? { focalLengthMm: value } : { position: value },
  },
};
const axisOf = (state, axis) => state.axes.find((one) => one.axis === axis) ?? {};

function setUpSliders() {
  for (const [axis, kind] of Object.entries(sliders)) {
    const there = axisInfo(axis) != null;
    byId(`${axis}-control`).hidden = !there;
    if (there) kind.setUp(byId(axis));
  }
}

/** The slider follows the lens, unless a hand is on it. */
function showSliders(state) {
  for (const [axis, kind] of Object.entries(sliders)) {
    if (!axisInfo(axis)) continue;
    const slider = byId(axis), value = kind.value(state);
    if (value == null) continue;
    if (slider.dataset.held !== "yes") slider.value = value;
    byId(`${axis}-value`).textContent = kind.text(value);
    slider.setAttribute("aria-valuetext", kind.text(Number(slider.value)));
  }
}

/** A hand is on it, and for a moment longer. */
function hold(slider) {
  slider.dataset.held = "yes";
  clearTimeout(slider.release);
  slider.release = setTimeout(() => { slider.dataset.held = "no"; }, 1500);
}

const exposureText = (ms) => ms < 1 ? `${digits(1000 * ms, 3)} µs` : `${digits(ms, 3)} ms`;

/** The slider of a camera that can be told how long to expose: from a thousandth of a frame's time to ten of them. */
async function showExposure() {
  const name = house.name, slider = byId("exposure"), camera = lensInfo()?.camera;
  byId("exposure-control").hidden = true;
  if (!camera) return;
  const { exposure } = await call("GetExposure", { lens: name });
  if (house.name !== name || !exposure.canSetExposure || !(exposure.exposureMs > 0)) return;
  const frame = 1000 / (camera.frameRateHz ?? 30);
  slider.min = Math.log2(Math.max(exposure.exposureMinMs ?? 0, frame / 1000));
  slider.max = Math.log2(Math.max(exposure.exposureMs, Math.min(exposure.exposureMaxMs ?? Infinity, 10 * frame)));
  slider.value = Math.log2(exposure.exposureMs);
  tellExposure(exposure.exposureMs);
  byId("exposure-control").hidden = false;
}

function tellExposure(ms) {
  byId("exposure-value").textContent = exposureText(ms);
  byId("exposure").setAttribute("aria-valuetext", exposureText(ms));
}

const setExposure = newestOnly((ms) => attempt(async () => {
  const { exposure } = await call("SetExposure", { lens: house.name, exposureMs: ms });
  tellExposure(exposure.exposureMs);
}));

function bindSliders() {
  byId("exposure").addEventListener("input", (event) => { hold(event.target); setExposure(2 ** Number(event.target.value)); });
  for (const [axis, kind] of Object.entries(sliders)) {
    const slider = byId(axis);
    slider.addEventListener("input", () => {
      hold(slider);
      byId(`${axis}-value`).textContent = kind.text(Number(slider.value));
      steer([axis, kind.target(Number(slider.value))]);
    });
  }
  for (const button of document.querySelectorAll("[data-nearer]")) {
    button.addEventListener("click", () => move("focus", { nearer: Number(button.dataset.nearer) }));
  }
}

// ---- The picture ------------------------------------------------------------------------------------------------------

const view = { abort: null, zoom: null, times: [], shown: 0, last: null };

/** The parts of a multipart/x-mixed-replace body, as {about, bytes}, however the reads fall. */
async function* partsOf(body) {
  const reader = body.getReader(), decoder = new TextDecoder();
  let held = new Uint8Array(0);
  const read = async () => {
    const { done, value } = await reader.read();
    if (done) return false;
    const joined = new Uint8Array(held.length + value.length);
    joined.set(held);
    joined.set(value, held.length);
    held = joined;
    return true;
  };
  const headEnd = () => {
    for (let i = 0; i + 3 < held.length; ++i) {
      if (held[i] === 13 && held[i + 1] === 10 && held[i + 2] === 13 && held[i + 3] === 10) return i;
    }
    return -1;
  };
  for (;;) {
    let end = headEnd();
    while (end < 0) {
      if (!await read()) return;
      end = headEnd();
    }
    const head = decoder.decode(held.subarray(0, end));
    const size = Number(/Content-Length: (\d+)/.exec(head)[1]), whole = end + 4 + size + 2;
    if (held.length < whole) {
      const pieces = [held];
      let length = held.length;
      while (length < whole) {
        const { done, value } = await reader.read();
        if (done) return;
        pieces.push(value);
        length += value.length;
      }
      held = new Uint8Array(length);
      let at = 0;
      for (const piece of pieces) { held.set(piece, at); at += piece.length; }
    }
    const about = JSON.parse(/X-Picture: (.*)/.exec(head)[1]);
    const bytes = held.slice(end + 4, end + 4 + size);
    held = held.slice(whole);
    yield { about, bytes };
  }
}

function viewAddress() {
  const width = Math.min(1920, Math.ceil(byId("frame").clientWidth * Math.min(2, devicePixelRatio) / 320) * 320);
  const asked = new URLSearchParams({ lens: house.name, width, rate: 60, errors: "body" });
  for (const [side, value] of Object.entries(view.zoom ?? {})) asked.set(side, value.toFixed(5));
  return `/live.mjpg?${asked}`;
}

async function look() {
  view.abort?.abort();
  if (document.hidden || house.role === "none") return;
  if (!lensInfo()) return noPicture(house.connected ? "No lens is configured yet. lensctl setup helps with it." : "no picture yet");
  const abort = view.abort = new AbortController();
  if (!lensInfo().camera) return noPicture(lensState()?.connected === false ? "This lens is not there." : "This lens has no camera.");
  for (let wait = 250; !abort.signal.aborted; wait = Math.min(wait * 2, 8000)) {
    try {
      const answer = await fetch(viewAddress(), { signal: abort.signal });
      if (!answer.headers.get("Content-Type").startsWith("multipart/")) throw failureOf(await answer.json());
      for await (const part of partsOf(answer.body)) {
        await show(part);
        wait = 250;
      }
      noPicture("The picture ended; looking again …");
    } catch (failure) {
      if (abort.signal.aborted) return;
      noPicture(wordsOf(failure));
    }
    await pause(wait);
  }
}

function noPicture(why) {
  byId("frametext").textContent = "";
  byId("nopicture").textContent = why;
  byId("nopicture").hidden = false;
}

async function show({ about, bytes }) {
  const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/jpeg" }));
  const canvas = byId("picture"), overlay = byId("overlay");
  if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
    for (const one of [canvas, overlay]) [one.width, one.height] = [bitmap.width, bitmap.height];
    byId("frame").style.aspectRatio = `${bitmap.width} / ${bitmap.height}`;
  }
  canvas.getContext("2d").drawImage(bitmap, 0, 0);
  bitmap.close();
  byId("nopicture").hidden = true;
  view.last = about;
  view.shown += 1;
  const now = performance.now();
  view.times = view.times.filter((time) => now - time < 1000).concat(now);
  drawOverlay();
  if (view.shown % 3 === 0) showFrame(about);
}

function showFrame({ frame, picture }) {
  if (!frame) return;
  byId("frametext").textContent = `${view.times.length} pictures a second · ${frame.widthPx} × ${frame.heightPx} · ` +
    `${digits(frame.exposureMs, 3)} ms${frame.fNumber ? ` · f/${digits(frame.fNumber, 3)}` : ""}${frame.moving ? " · moving" : ""}` +
    (picture.sharpness == null ? "" : ` · sharpness ${digits(picture.sharpness, 3)}`);
  if (byId("exposure").dataset.held !== "yes") {
    byId("exposure").value = Math.log2(frame.exposureMs);
    tellExposure(frame.exposureMs);
  }
  drawHistogram(picture.histogram ?? []);
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function drawHistogram(counts) {
  const canvas = byId("histogram"), pen = canvas.getContext("2d");
  const all = counts.reduce((sum, one) => sum + one, 0);
  if (!all) return;
  const most = Math.max(...counts), step = canvas.width / counts.length;
  pen.clearRect(0, 0, canvas.width, canvas.height);
  counts.forEach((count, at) => {
    const end = at === 0 || at === counts.length - 1;
    pen.fillStyle = colour(end && count > 0.001 * all ? "--danger" : "--soft");
    const height = Math.sqrt(count / most) * canvas.height;
    pen.fillRect(at * step, canvas.height - height, step - 0.5, height);
  });
  const part = (count) => `${digits(100 * count / all, 2)} %`;
  byId("clipping").textContent = `darkest 64th ${part(counts[0])}, brightest 64th ${part(counts[counts.length - 1])}` +
    (counts[counts.length - 1] > 0.01 * all ? ": clipping" : "");
}

/** Colours what is sharp: where neighbours differ by more than most do. */
function drawPeaking(pen, width, height) {
  const small = { w: Math.min(480, width), h: Math.round(Math.min(480, width) * height / width) };
  const work = view.work ??= document.createElement("canvas");
  [work.width, work.height] = [small.w, small.h];
  const brush = work.getContext("2d", { willReadFrequently: true });
  brush.drawImage(byId("picture"), 0, 0, small.w, small.h);
  const image = brush.getImageData(0, 0, small.w, small.h), data = image.data, marks = new Float32Array(small.w * small.h);
  let sum = 0;
  for (let y = 1; y + 1 < small.h; ++y) {
    for (let x = 1; x + 1 < small.w; ++x) {
      const at = 4 * (y * small.w + x);
      const edge = Math.abs(4 * data[at + 1] - data[at - 3] - data[at + 5] - data[at + 1 - 4 * small.w] - data[at + 1 + 4 * small.w]);
      marks[y * small.w + x] = edge;
      sum += edge;
    }
  }
  const least = Math.max(24, 4 * sum / marks.length);
  for (let i = 0; i < marks.length; ++i) {
    const on = marks[i] > least;
    [data[4 * i], data[4 * i + 1], data[4 * i + 2], data[4 * i + 3]] = on ? [255, 40, 40, 255] : [0, 0, 0, 0];
  }
  brush.putImageData(image, 0, 0);
  pen.drawImage(work, 0, 0, width, height);
}

const inks = { sharp: "#7ee0b2", blurred: "#ffb37a" };  // on pictures, whatever they show

/** Disks of the blur that each depth of the plan has with the lens as it stands, in pixels of the picture shown. */
function drawDisks(pen, width, height) {
  const state = lensState(), f = focalMm(), pitch = pixelUm(), picture = view.last?.picture, frame = view.last?.frame;
  if (!f || !pitch || state?.extensionMm == null || !state.fNumber || !picture || !frame) return;
  const shownPx = (view.zoom?.w ?? 1) * frame.widthPx, scale = width / shownPx;
  let x = 12;
  pen.font = `${11 * width / (byId("overlay").clientWidth || width)}px system-ui`;
  for (const limit of plan.limits) {
    for (const u of [limit.nearD, limit.farD]) {
      const radius = Math.abs(optics.blurUm(f, state.fNumber, state.extensionMm, u)) / pitch * scale / 2;
      pen.strokeStyle = inks[limit.kind];
      pen.lineWidth = Math.max(1, width / 400);
      pen.beginPath();
      pen.arc(x + radius, height - 16 - radius, Math.max(0.5, radius), 0, 2 * Math.PI);
      pen.stroke();
      pen.fillStyle = pen.strokeStyle;
      pen.fillText(distanceText(u), x, height - 22 - 2 * radius);
      x += 2 * radius + width / 9;
    }
  }
}

const pointer = { from: null, to: null, shownUntil: 0, region: null, keys: null };

/** A part of the frame, in the part that is shown. */
function shownPart(region) {
  const zoom = view.zoom ?? { x: 0, y: 0, w: 1, h: 1 };
  return { x: (region.x - zoom.x) / zoom.w, y: (region.y - zoom.y) / zoom.h, w: region.w / zoom.w, h: region.h / zoom.h };
}

function drawBox(pen, box, width, height, ink) {
  pen.strokeStyle = ink;
  pen.lineWidth = Math.max(2, width / 300);
  pen.strokeRect(box.x * width, box.y * height, box.w * width, box.h * height);
}

/** The places of limits, with the blur measured there beside the blur planned. */
function drawPlaces(pen, width, height) {
  const size = 12 * width / (byId("overlay").clientWidth || width);  // as large as other letters, however small the picture is shown
  pen.font = `600 ${size}px system-ui`;
  for (const limit of plan.limits.filter((one) => one.place)) {
    const box = shownPart(limit.place), ink = inks[limit.kind];
    drawBox(pen, box, width, height, ink);
    const lines = [limit.name, ...(limit.measured ? measuredText(limit).split(/, |(?<=px): /) : [])];
    const wide = Math.max(...lines.map((line) => pen.measureText(line).width)) + size;
    const left = Math.min(Math.max(0, box.x * width), width - wide), tall = lines.length * size * 1.3 + size * 0.4;
    const below = (box.y + box.h) * height, top = below + tall < height ? below : Math.max(0, box.y * height - tall);
    pen.fillStyle = "#000c";
    pen.fillRect(left, top, wide, tall);
    pen.fillStyle = ink;
    lines.forEach((line, at) => pen.fillText(line, left + size / 2, top + size * 1.3 * (at + 1)));
  }
}

function drawOverlay() {
  const canvas = byId("overlay"), pen = canvas.getContext("2d"), { width, height } = canvas;
  pen.clearRect(0, 0, width, height);
  if (byId("peaking").checked) drawPeaking(pen, width, height);
  if (byId("disks").checked) drawDisks(pen, width, height);
  drawPlaces(pen, width, height);
  const box = pointer.from ? boxOf(pointer.from, pointer.to) : pointer.keys ??
    (performance.now() < pointer.shownUntil || search.holding ? pointer.region : null);
  if (box) drawBox(pen, box, width, height, "#ffcc33");
}

/** A place in the part of the frame that is shown, 0 to 1. */
function placeOf(event) {
  const box = byId("overlay").getBoundingClientRect();
  const clamp = (value) => Math.min(1, Math.max(0, value));
  return { x: clamp((event.clientX - box.left) / box.width), y: clamp((event.clientY - box.top) / box.height) };
}

/** The rectangle between two places; a click means a fifth of the picture around it. */
function boxOf(from, to) {
  let [x, y, w, h] = [Math.min(from.x, to.x), Math.min(from.y, to.y), Math.abs(from.x - to.x), Math.abs(from.y - to.y)];
  if (w < 0.03 || h < 0.03) [x, y, w, h] = [from.x - 0.1, from.y - 0.1, 0.2, 0.2];
  x = Math.min(Math.max(0, x), 1 - w);
  y = Math.min(Math.max(0, y), 1 - h);
  return { x, y, w, h };
}

/** From a part of what is shown to a part of the frame. */
function inFrame(box) {
  const zoom = view.zoom ?? { x: 0, y: 0, w: 1, h: 1 };
  const w = Math.min(box.w * zoom.w, 1), h = Math.min(box.h * zoom.h, 1);
  return { x: Math.min(zoom.x + box.x * zoom.w, 1 - w), y: Math.min(zoom.y + box.y * zoom.h, 1 - h), w, h };
}

function pick(box) {
  if (!lensInfo()?.camera) return;
  if (plan.placing) return placeLimit(inFrame(box));
  pointer.region = box;
  pointer.shownUntil = performance.now() + 2500;
  const mode = document.querySelector("input[name=mode]:checked").value;
  if (mode === "zoom") return zoomTo(inFrame(box));
  if (house.role !== "move") return note("Your token is for looking on: it may not move the lens.");
  autofocus({ region: inFrame(box), ...(mode === "track" ? { track: true } : {}) });
}

/** The same without a mouse: arrow keys move a box, + and - change its size, Enter uses it. */
function pickByKey(event) {
  const box = pointer.keys ??= { x: 0.4, y: 0.4, w: 0.2, h: 0.2 }, by = event.shiftKey ? 0.1 : 0.02;
  const moves = { ArrowLeft: [-by, 0], ArrowRight: [by, 0], ArrowUp: [0, -by], ArrowDown: [0, by] }[event.key];
  const grow = { "+": 1.25, "-": 0.8 }[event.key];
  if (event.key === "Enter") {
    event.preventDefault();
    pointer.keys = null;
    return pick(box);
  }
  if (!moves && !grow) return;
  event.preventDefault();
  if (grow) box.w = box.h = Math.min(1, Math.max(0.05, box.w * grow));
  box.x = Math.min(Math.max(0, box.x + (moves?.[0] ?? 0)), 1 - box.w);
  box.y = Math.min(Math.max(0, box.y + (moves?.[1] ?? 0)), 1 - box.h);
  const part = (value) => `${Math.round(100 * value)} %`;
  byId("boxtext").textContent = `box ${part(box.w)} wide, its middle at ${part(box.x + box.w / 2)} from the left and ${part(box.y + box.h / 2)} from the top`;
  drawOverlay();
}

function zoomTo(region) {
  view.zoom = region;
  pointer.region = null;
  byId("whole").disabled = !region;
  look();
}

function bindPicture() {
  const overlay = byId("overlay");
  overlay.addEventListener("pointerdown", (event) => {
    overlay.setPointerCapture(event.pointerId);
    pointer.from = pointer.to = placeOf(event);
  });
  overlay.addEventListener("pointermove", (event) => {
    if (pointer.from) { pointer.to = placeOf(event); drawOverlay(); }
  });
  overlay.addEventListener("pointerup", (event) => {
    if (!pointer.from) return;
    const box = boxOf(pointer.from, placeOf(event));
    pointer.from = null;
    pick(box);
  });
  overlay.addEventListener("pointercancel", () => { pointer.from = null; });
  overlay.addEventListener("keydown", pickByKey);
  overlay.addEventListener("blur", () => { pointer.keys = null; drawOverlay(); });
  byId("whole").addEventListener("click", () => zoomTo(null));
}

// ---- Charts -----------------------------------------------------------------------------------------------------------

const charts = new Map();
function chart(id, data, series, axes, marks) {
  charts.get(id)?.destroy();
  const place = byId(id), width = place.clientWidth || 300;
  const look = { stroke: colour("--soft"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line") } };
  charts.set(id, new uPlot({
    width, height: 190, legend: { show: false }, cursor: { drag: { x: false, y: false } },
    scales: { x: { time: false } }, axes: axes.map((axis) => ({ ...look, size: 46, labelSize: 16, ...axis })),
    series: [{}, ...series], hooks: { draw: [marks] },
  }, data, place));
}

function clearChart(id) {
  charts.get(id)?.destroy();
  charts.delete(id);
}

/** A vertical line in a chart. */
function markAt(plot, x, name) {
  if (x == null) return;
  const at = plot.valToPos(x, "x", true), pen = plot.ctx;
  if (at < plot.bbox.left || at > plot.bbox.left + plot.bbox.width) return;
  pen.save();
  pen.strokeStyle = colour(name);
  pen.lineWidth = 2;
  pen.beginPath();
  pen.moveTo(at, plot.bbox.top);
  pen.lineTo(at, plot.bbox.top + plot.bbox.height);
  pen.stroke();
  pen.restore();
}

// ---- Autofocus --------------------------------------------------------------------------------------------------------

const search = { abort: null, samples: [], result: null, region: null, holding: false };

function drawCurve() {
  const known = search.samples.every((sample) => sample.vergenceD != null);
  const place = (sample) => known ? sample.vergenceD : sample.position;
  const sorted = search.samples.filter((sample) => sample.region === 0).sort((one, other) => place(one) - place(other));
  if (sorted.length === 0) return;
  const subject = search.result?.subject;
  const sigma = known ? subject?.sigmaD : null, centre = subject ? (known ? subject.vergenceD : subject.position) : null;
  chart("curve", [sorted.map(place), sorted.map((sample) => sample.score)],
    [{ stroke: colour("--main"), width: 1.5, points: { show: true, size: 6, fill: colour("--card") } }],
    [{ label: known ? "vergence (D)" : `position (${axisInfo("focus").unit})` }, { label: "sharpness", size: 60 }],
    (plot) => {
      markAt(plot, centre, "--danger");
      if (sigma && centre != null) [centre - sigma, centre + sigma].forEach((at) => markAt(plot, at, "--blurred"));
    });
}

/** Drawing it takes a while: the picture comes first. */
let curveDue = 0;
function drawCurveSoon() {
  curveDue ||= setTimeout(() => { curveDue = 0; drawCurve(); }, search.result ? 0 : 200);
}

function showFound(result) {
  const where = result.vergenceD == null ? `position ${digits(result.position)}` : distanceText(result.vergenceD);
  byId("found").textContent = (search.holding ? "Keeping it in focus until Stop. " : "") + (result.focused ? `Focused at ${where}` : "Refused") +
    (result.sigmaD == null ? "" : ` ± ${digits(result.sigmaD, 2)} D`) +
    `: ${result.reason} (${result.method}, ${result.frames} frames, ${result.moves} moves, ${digits(result.elapsedMs / 1000, 3)} s)`;
}

/** A stream may just end, as when lens-web goes. */
function answered(whole) {
  if (!whole) throw new Error("the connection was lost before its answer came");
}

async function autofocus(more = {}) {
  search.abort?.abort();
  const abort = search.abort = new AbortController();
  search.samples = [];
  search.result = null;
  search.region = more.region ?? null;
  search.holding = more.track === true;
  byId("found").textContent = more.track ? "Keeping it in focus …" : "Searching …";
  const method = byId("method").value;
  const asked = { lens: house.name, ...more, ...(method === "auto" ? {} : { method }) };
  await attempt(() => callMore("Autofocus", asked, ({ progress, autofocus: result }) => {
    if (progress) search.samples = progress.samples;
    if (result) {
      search.samples = result.samples;
      search.result = result;
      showFound(result);
    }
    drawCurveSoon();
  }, abort.signal).then((last) => answered(last?.autofocus && !more.track)).catch((failure) => {
    if (failure.name !== "AbortError") byId("found").textContent = "Ended: " + wordsOf(failure);
    throw failure;
  }));
  if (search.abort === abort) search.abort = null, search.holding = false;
}

// ---- The planner ------------------------------------------------------------------------------------------------------

const plan = { limits: [], answer: null, done: "", count: 0, held: null, placing: null };

function planRange() {
  const range = vergenceRange();
  return range ? [Math.min(0, range[0]), Math.max(range[1], 0.2)] : [0, 2];
}

function addLimit(kind) {
  const [low, high] = planRange(), now = Math.max(lensState()?.vergenceD ?? (low + high) / 2, 0);
  const part = (high - low) / 20;
  const [farD, nearD] = kind === "sharp" ? [Math.max(0, now - part / 2), now + part / 2] : [Math.max(0, low), Math.max(part, now / 3)];
  plan.count += 1;
  const limit = { name: `${kind}-${plan.count}`, kind, farD, nearD: Math.min(nearD, high), limitPx: kind === "sharp" ? 2 : 8 };
  // What was focused on last is what must be sharp, if the lens is still there.
  const found = search.result?.focused && search.region && Math.abs(search.result.vergenceD - now) < (high - low) / 500;
  if (kind === "sharp" && found) limit.place = search.region;
  plan.limits.push(limit);
  planChanged();
}

/** The next click in the picture says where that limit is. */
function beginPlacing(limit) {
  plan.placing = limit;
  byId("placing").textContent = `Click or draw a box where ${limit.name} is in the picture (Esc: leave it).`;
  byId("frame").scrollIntoView({ block: "center" });
  byId("overlay").focus({ preventScroll: true });
}

function placeLimit(region) {
  const limit = plan.placing;
  endPlacing();
  limit.place = region;
  delete limit.measured;
  listLimits();
  drawOverlay();
}

function endPlacing() {
  plan.placing = null;
  byId("placing").textContent = "";
}

function limitText(limit) {
  return `${limit.name}: blur ${limit.kind === "sharp" ? "at most" : "at least"} ${limit.limitPx} px from ` +
    `${distanceText(limit.farD)} to ${distanceText(limit.nearD)}`;
}

function listLimits() {
  byId("limits").replaceChildren(...plan.limits.map((limit) => {
    const item = document.createElement("li"), text = document.createElement("span"), remove = document.createElement("button");
    const size = document.createElement("input"), where = document.createElement("button");
    text.className = limit.kind;
    text.textContent = limitText(limit) + verdictOf(limit) + (limit.measured ? `; ${measuredText(limit)}` : "");
    Object.assign(size, { type: "number", min: 0.1, max: 200, step: 0.1, value: limit.limitPx, ariaLabel: `${limit.name}: limit in px` });
    size.addEventListener("change", () => { limit.limitPx = Math.max(0.1, Number(size.value) || 1); planChanged(); });
    remove.type = "button";
    remove.textContent = "Remove";
    remove.setAttribute("aria-label", `Remove ${limit.name}`);
    remove.addEventListener("click", () => {
      plan.limits = plan.limits.filter((one) => one !== limit);
      if (plan.placing === limit) endPlacing();
      planChanged();
    });
    where.type = "button";
    where.textContent = limit.place ? "In the picture: marked" : "Where in the picture?";
    where.setAttribute("aria-label", `Show where ${limit.name} is in the picture`);
    where.addEventListener("click", () => beginPlacing(limit));
    item.append(text, size, ...(lensInfo()?.camera ? [where] : []), remove);
    return item;
  }));
}

function verdictOf(limit) {
  const told = plan.answer?.limits?.find((one) => one.name === limit.name);
  if (!told?.worstUm || !pixelUm()) return "";
  return ` — ${limit.kind === "sharp" ? "at most" : "at least"} ${digits(told.worstUm / pixelUm(), 3)} px with this plan`;
}

function drawAxis() {
  const svg = byId("axis"), [low, high] = planRange();
  if (svg.contains(document.activeElement)) plan.held = document.activeElement.dataset.handle;
  svg.replaceChildren();
  const scale = scaleOf(svg, low, high), rows = Math.max(2, plan.limits.length), step = Math.min(26, 96 / rows);
  svg.style.height = `${Math.max(60, rows * step + 34)}px`;
  const bottom = rows * step + 12;
  plan.limits.forEach((limit, row) => drawLimit(svg, scale, limit, row * step + 4, step - 6, low, high));
  shape(svg, "line", { class: "tick", x1: scale.x(low), x2: scale.x(high), y1: bottom, y2: bottom });
  const plane = plan.answer?.focalPlaneD;
  if (plane != null) shape(svg, "line", { class: "now", x1: scale.x(plane), x2: scale.x(plane), y1: 0, y2: bottom });
  drawTicks(svg, scale, low, high, bottom);
  if (plan.held) svg.querySelector(`[data-handle="${plan.held}"]`)?.focus({ preventScroll: true });
  plan.held = null;
}

function drawLimit(svg, scale, limit, y, height, low, high) {
  const [left, right] = [scale.x(limit.farD), scale.x(limit.nearD)];
  shape(svg, "rect", { class: `band ${limit.kind}`, x: left, width: Math.max(1, right - left), y, height });
  for (const end of ["farD", "nearD"]) {
    const handle = shape(svg, "rect", {
      class: `handle ${limit.kind}`, x: scale.x(limit[end]) - 5, width: 10, y: y - 2, height: height + 4, rx: 3, role: "slider", tabindex: 0,
      "data-handle": `${limit.name}-${end}`, "aria-label": `${limit.name}, ${end === "farD" ? "far" : "near"} end`,
      "aria-valuemin": low, "aria-valuemax": high, "aria-valuenow": limit[end], "aria-valuetext": distanceText(limit[end]),
    });
    bindHandle(svg, scale, handle, limit, end, (high - low) / 200);
  }
}

function setEnd(limit, end, vergence) {
  limit[end] = Math.max(0, vergence);
  if (limit.farD > limit.nearD) limit[end] = end === "farD" ? limit.nearD : limit.farD;
  planChanged();
}

function bindHandle(svg, scale, handle, limit, end, step) {
  handle.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    plan.held = handle.dataset.handle;
    handle.focus({ preventScroll: true });
    const drag = (moved) => setEnd(limit, end, scale.vergence(moved.clientX - svg.getBoundingClientRect().left));
    const drop = () => {
      window.removeEventListener("pointermove", drag);
      window.removeEventListener("pointerup", drop);
      window.removeEventListener("pointercancel", drop);
    };
    window.addEventListener("pointermove", drag);
    window.addEventListener("pointerup", drop);
    window.addEventListener("pointercancel", drop);
  });
  handle.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -step, ArrowDown: -step, ArrowRight: step, ArrowUp: step, PageDown: -10 * step, PageUp: 10 * step }[event.key];
    if (by == null) return;
    event.preventDefault();
    setEnd(limit, end, limit[end] + by);
  });
}

function planRequest() {
  return { limits: plan.limits.map((limit) => ({
    name: limit.name, kind: limit.kind, limitPx: limit.limitPx,
    depths: [{ oneEnd: { vergenceD: limit.nearD }, otherEnd: { vergenceD: limit.farD } }] })) };
}

const askPlan = newestOnly(async () => {
  if (plan.limits.length === 0) plan.answer = null;
  else {
    try {
      plan.answer = (await call("Plan", { lens: house.name, request: planRequest() })).plan;
      note(null);
    } catch (failure) {
      plan.answer = null;
      showPlan();
      byId("verdict").textContent = wordsOf(failure);
      return;
    }
  }
  showPlan();
});

function planChanged() {
  plan.done = "";
  for (const limit of plan.limits) delete limit.measured;
  drawAxis();
  listLimits();
  drawRegion();
  askPlan();
}

/** What a conflict may name beside limits. */
const givens = {
  fNumber: "the f-numbers of this lens", extension: "the travel of its focus", focus: "the focus asked for", depth: "the depth of field",
  positions: "where its motors can stand",
};

function planWords(answer) {
  if (!lensInfo()) return "";
  if (!lensInfo().optics) return "This lens is not calibrated: what blur it makes at which distance is not known, so there is nothing to plan with.";
  if (!answer) return "No limits yet: say what must be sharp and what must be blurred.";
  if (answer.feasible) {
    return `f/${digits(answer.fNumber, 3)} focused at ${distanceText(answer.focalPlaneD)}, extension ${digits(answer.extensionMm, 4)} mm` +
      (answer.worstRatio == null ? "" : `; the tightest limit is used to ${Math.round(100 * answer.worstRatio)} %`) + (answer.note ? `. ${answer.note}` : "");
  }
  const causes = (answer.causes ?? []).map((cause) => cause.reason).join("; or ");
  const words = `No setting meets all of this: ${(answer.conflict ?? []).map((name) => givens[name] ?? name).join(", ")} contradict each other; without any one of them there is a plan.${causes ? ` Possible but for ${causes}.` : ""}`;
  return words + (answer.relax ? ` With every limit eased by a factor of ${digits(answer.relax, 3)} there would be one` +
    (answer.relaxed?.fNumber ? `: f/${digits(answer.relaxed.fNumber, 3)} at ${distanceText(answer.relaxed.focalPlaneD)}.` : ".") : " No easing of the limits helps.");
}

function showPlan() {
  byId("verdict").textContent = planWords(plan.answer) + plan.done;
  showPlanButtons();
  drawAxis();
  listLimits();
  drawRegion();
  drawBlur();
}

function showPlanButtons() {
  const calibrated = lensInfo()?.optics != null, moves = house.role === "move";
  byId("apply").disabled = !plan.answer?.feasible || !moves || plan.busy;
  byId("add-sharp").disabled = byId("add-blurred").disabled = !calibrated;
  byId("stack").disabled = !calibrated || !moves || plan.busy || !lensInfo().camera || !plan.limits.some((limit) => limit.kind === "sharp");
}

/** Does this setting keep a limit, as far as the thin lens says? */
function keeps(limit, f, n, e) {
  const blurs = [limit.nearD, limit.farD].map((u) => optics.blurUm(f, n, e, u) / pixelUm());
  if (limit.kind === "sharp") return Math.max(...blurs.map(Math.abs)) <= limit.limitPx;
  return blurs[0] * blurs[1] > 0 && Math.min(...blurs.map(Math.abs)) >= limit.limitPx;
}

function drawRegion() {
  const canvas = byId("region"), known = lensInfo()?.optics, f = focalMm();
  canvas.width = canvas.clientWidth || 320;  // as many pixels as it is wide: text stays in shape
  const pen = canvas.getContext("2d");
  pen.clearRect(0, 0, canvas.width, canvas.height);
  if (!known || !f || !pixelUm() || plan.limits.length === 0) return;
  const low = Math.log2(known.fNumberMin), high = Math.log2(known.fNumberMax), cells = [128, 88];
  const [dx, dy] = [canvas.width / cells[0], canvas.height / cells[1]];
  const extensionAt = (row) => known.extensionMinMm + (row + 0.5) / cells[1] * (known.extensionMaxMm - known.extensionMinMm);
  pen.fillStyle = colour("--fill");
  for (let column = 0; column < cells[0]; ++column) {
    const n = 2 ** (low + (column + 0.5) / cells[0] * (high - low));
    for (let row = 0; row < cells[1]; ++row) {
      if (plan.limits.every((limit) => keeps(limit, f, n, extensionAt(row)))) {
        pen.fillRect(column * dx, canvas.height - (row + 1) * dy, dx + 0.5, dy + 0.5);
      }
    }
  }
  pen.fillStyle = colour("--soft");
  pen.font = "12px system-ui";
  for (let stopNumber = Math.ceil(2 * low) / 2; stopNumber <= high; stopNumber += 1) {
    const x = (stopNumber - low) / (high - low) * canvas.width;
    pen.fillText(`f/${digits(2 ** stopNumber, 2)}`, Math.min(x, canvas.width - 30), canvas.height - 4);
  }
  pen.fillText(`${digits(known.extensionMaxMm, 3)} mm`, 2, 12);
  const answer = plan.answer;
  if (!answer?.feasible) return;
  const x = (Math.log2(answer.fNumber) - low) / (high - low) * canvas.width;
  const y = canvas.height * (1 - (answer.extensionMm - known.extensionMinMm) / (known.extensionMaxMm - known.extensionMinMm));
  pen.fillStyle = colour("--danger");
  pen.beginPath();
  pen.arc(Math.min(Math.max(x, 5), canvas.width - 5), Math.min(Math.max(y, 5), canvas.height - 5), 5, 0, 2 * Math.PI);
  pen.fill();
}

function drawBlur() {
  const answer = plan.answer, f = answer?.focalLengthMm ?? focalMm();
  if (!answer?.feasible || !f || !pixelUm()) return clearChart("blur");
  const [low, high] = planRange(), places = Array.from({ length: 201 }, (_, i) => low + (high - low) * i / 200);
  const blurs = places.map((u) => Math.abs(optics.blurUm(f, answer.fNumber, answer.extensionMm, u)) / pixelUm());
  chart("blur", [places, blurs], [{ stroke: colour("--main"), width: 2 }], [{ label: "vergence (D)" }, { label: "blur (px)" }],
    (plot) => plan.limits.forEach((limit) => [limit.farD, limit.nearD].forEach((u) => markAt(plot, u, limit.kind === "sharp" ? "--sharp" : "--blurred"))));
}

/** One thing at a time of those that move the lens for a while. */
async function whileBusy(work) {
  plan.busy = true;
  showPlanButtons();
  await attempt(work);
  plan.busy = false;
  showPlanButtons();
}

function applyPlan() {
  return whileBusy(async () => {
    const answer = await call("Plan", { lens: house.name, request: planRequest(), apply: true });
    const missed = (answer.applied ?? []).filter((one) => !one.reached);
    plan.done = missed.length
      ? `. Not reached: ${missed.map((one) => `${one.axis} (${one.reason ?? one.cause})`).join(", ")}.`
      : `. Applied; where the motors stand the tightest limit is used to ${Math.round(100 * (answer.reached?.worstRatio ?? NaN))} %.`;
    plan.answer = { ...answer.plan, limits: answer.reached?.limits ?? answer.plan.limits };
    showPlan();
    if (missed.length === 0) await measureBlur();
  });
}

// ---- All lenses and what they did -------------------------------------------------------------------------------------

const kinds = {
  move: (m) => `${m.axis} ${m.reached ? "reached" : "did not reach"} ${m.vergenceD != null ? distanceText(m.vergenceD) : m.fNumber != null ? `f/${digits(m.fNumber, 3)}` : digits(m.position)}` +
    `${m.verified ? ", verified" : ""}${m.reached ? "" : `: ${m.reason ?? m.cause ?? ""}`}`,
  autofocus: (a) => a.focused ? `autofocus: ${distanceText(a.vergenceD)}` : `autofocus refused: ${a.reason}`,
  backlash: (b) => `backlash of ${b.axis} ${b.known ? `is ${digits(b.size ?? 0)}` : `not measured: ${b.reason ?? ""}`}`,
  fault: (f) => f.fault ? `${f.axis} complains: ${f.fault}` : `${f.axis} is well again`,
  thermometer: (t) => t.fault ? `thermometer is not believed: ${t.fault}` : "thermometer is believed again",
  lease: (l) => `lease ${l.change} (${l.holder})`,
  calibration: (c) => `calibration changed: ${c.grade}`,
  preset: (p) => `preset ${p.label} ${p.change}`,
  refocus: (r) => `refocus for ${r.cause}: ${r.end} (${r.reason})`,
  list: (l) => `${l.change}${l.reason ? `: ${l.reason}` : ""}`,
};

const kindOf = (event) => Object.keys(kinds).find((name) => event[name]);
const isBad = (event) => event.fault?.fault || event.thermometer?.fault || (event.move && !event.move.reached);
const kPast = { longMs: 3600e3, most: 2000, shown: 200 };

function tellEvent(event, atMs) {
  const kind = kindOf(event);
  if (!kind) return;
  house.past.push({ event, atMs });
  while (house.past.length > kPast.most || house.past[0].atMs < Date.now() - kPast.longMs) house.past.shift();
  const item = document.createElement("li"), time = document.createElement("time");
  time.dateTime = new Date(atMs).toISOString();
  time.textContent = new Date(atMs).toLocaleTimeString();
  item.append(time, `${event.lens}: ${kinds[kind](event[kind])}`);
  if (isBad(event)) item.className = "bad";
  byId("events").prepend(item);
  while (byId("events").children.length > kPast.shown) byId("events").lastChild.remove();
}

/** "12 moves, 1 missed, 2 searches": what a lens did in the last hour. */
function lastHour(name) {
  const past = house.past.filter((one) => one.event.lens === name && one.atMs >= Date.now() - kPast.longMs).map((one) => one.event);
  const count = (what, one, many) => {
    const number = past.filter(what).length;
    return number === 0 ? [] : [`${number} ${number === 1 ? one : many ?? one}`];
  };
  return [...count((e) => e.move, "move", "moves"), ...count((e) => e.move && !e.move.reached, "missed"),
    ...count((e) => e.autofocus, "search", "searches"), ...count((e) => e.autofocus && !e.autofocus.focused, "refused"),
    ...count((e) => e.fault?.fault || e.thermometer?.fault, "fault", "faults"), ...count((e) => e.lease, "change of lease", "changes of lease"),
    ...count((e) => !e.move && !e.autofocus && !e.fault && !e.thermometer && !e.lease, "other event", "other events")].join(", ") || "nothing";
}

function cell(row, text, bad) {
  const made = document.createElement("td");
  made.textContent = text;
  if (bad) made.className = "bad";
  row.append(made);
}

const grades = {
  uncalibrated: "distances go by the lens' nominal data", approximate: "distances are approximate", calibrated: "distances are calibrated",
};

function stateWords(state) {
  const doing = state.connected ? state.activity : `${state.connection}: ${state.error ?? "no reason is known"}`;
  return doing + (state.latched ? "; a stop holds it until its faults are reset" : "");
}

function showOverview() {
  byId("lenses").replaceChildren(...[...house.states.values()].map((state) => {
    const row = document.createElement("tr"), name = document.createElement("th"), go = document.createElement("button");
    name.scope = "row";
    go.type = "button";
    go.textContent = state.name;
    go.addEventListener("click", () => { choose(state.name); byId("live").scrollIntoView(); });
    name.append(go);
    row.append(name);
    cell(row, stateWords(state), !state.connected || state.latched);
    cell(row, state.vergenceD == null ? `${axisOf(state, "focus").position ?? "—"}` : distanceText(state.vergenceD));
    cell(row, state.fNumber == null ? "—" : `f/${digits(state.fNumber, 3)}`);
    const faults = state.axes.filter((axis) => axis.fault).map((axis) => `${axis.axis}: ${axis.fault}`);
    cell(row, faults.join("; ") || "none", faults.length > 0);
    cell(row, state.lease?.holder ?? "free");
    cell(row, lastHour(state.name));
    return row;
  }));
}

// ---- What comes in ----------------------------------------------------------------------------------------------------

let drawn = 0;
function soon() {
  drawn ||= requestAnimationFrame(() => {
    drawn = 0;
    showOverview();
    const state = lensState();
    if (!state || !lensInfo()) return;
    showSliders(state);
    drawScale();
    const lost = (axis) => axisInfo(axis.axis)?.canHome && !axis.homed;
    byId("home").hidden = !state.connected || !state.axes.some(lost);
    byId("reset").hidden = !state.latched && !state.axes.some((axis) => axis.fault);
    tell("state", stateWords(state) + (state.grade ? `; ${grades[state.grade] ?? state.grade}` : "") + (state.lease ? `; leased to ${state.lease.holder}` : ""));
  });
}

function take(event) {
  if (event.status) {
    house.states.set(event.lens, event.status);
    soon();
  }
  if (event.list) loadLenses().catch(() => {});
  // A search that somebody else asked for grows here too; our own is told by its call.
  if (event.lens === house.name && !search.abort && (event.autofocus || event.progress?.autofocus)) {
    search.samples = (event.autofocus ?? event.progress.autofocus).samples;
    search.result = event.autofocus ?? null;
    if (event.autofocus) showFound(event.autofocus);
    else byId("found").textContent = "Somebody else's search is under way …";
    drawCurveSoon();
  }
  tellEvent(event, Date.now());
}

let events = null;
function listen() {
  clearTimeout(events?.again);
  events?.close();
  if (document.hidden || house.role === "none") return;
  events = new EventSource("/events");
  events.onmessage = (message) => take(JSON.parse(message.data));
  events.addEventListener("daemon", (message) => {
    const told = JSON.parse(message.data);
    house.connected = told.connected;
    byId("link").textContent = told.connected ? `connected${house.role === "view" ? ", to look on" : ""}` : `lensd is away: ${told.message}`;
    if (told.connected) return void attempt(loadLenses);
    for (const [name, state] of house.states) house.states.set(name, { ...state, connected: false, connection: "unknown", error: "lensd is away" });
    soon();
  });
  events.addEventListener("gap", () => { attempt(loadHistory); });
  events.onerror = () => {
    house.connected = false;
    byId("link").textContent = "lens-web does not answer; trying again";
    // A browser gives up where the answer is a refusal: too many streams, or a token that counts no more.
    if (events.readyState === EventSource.CLOSED) events.again = setTimeout(() => attempt(() => begin()), 3000);
  };
}

async function loadHistory() {
  const { events: past } = await (await fetch("/history")).json();
  byId("events").replaceChildren();
  house.past = [];
  for (const { atMs, event } of past) tellEvent(event, atMs);
  soon();
}

async function loadLenses() {
  const { lenses, features } = await call("List");
  house.features = features ?? [];
  house.lenses = new Map(lenses.map((lens) => [lens.name, lens]));
  for (const name of [...house.states.keys()]) if (!house.lenses.has(name)) house.states.delete(name);
  byId("lens").replaceChildren(...lenses.map((lens) => new Option(lens.name)));
  for (const state of (await call("Status")).lenses) house.states.set(state.name, state);
  choose(house.lenses.has(house.name) ? house.name : lenses[0]?.name ?? null);
}

/** What belonged to the lens before. */
function forget() {
  search.abort?.abort();
  Object.assign(search, { abort: null, samples: [], result: null, region: null, holding: false });
  Object.assign(plan, { limits: [], answer: null, count: 0 });
  Object.assign(pointer, { region: null, keys: null });
  view.zoom = null;
  for (const id of ["picture", "overlay", "histogram"]) byId(id).getContext("2d").clearRect(0, 0, 9999, 9999);
  byId("whole").disabled = true;
  endPlacing();
  clearStrip();
  byId("mapped").hidden = true;
  for (const id of ["found", "stacked", "bounds", "state", "clipping"]) byId(id).textContent = "";
  for (const id of ["curve", "blur"]) clearChart(id);
  note(null);
}

function choose(name) {
  const other = name !== house.name;
  house.name = name;
  if (name) byId("lens").value = name;
  if (other) forget();
  setUpSliders();
  allow(house.role);
  soon();
  planChanged();
  showExposure().catch(() => {});
  if (other || byId("nopicture").hidden === false) look();
}

// ---- Beginning --------------------------------------------------------------------------------------------------------

function allow(role) {
  house.role = role;
  const moves = role === "move" && lensInfo() != null, looks = moves && lensInfo().camera != null;
  for (const control of document.querySelectorAll("#controls input:not(#limit), #controls button")) control.disabled = !moves;
  for (const control of document.querySelectorAll("#find, #map, #method, [name=mode]")) control.disabled = !looks;
  byId("map").hidden = !house.features.includes("focusMap") || !lensInfo()?.optics;
  document.querySelector("[name=mode][value=zoom]").disabled = !lensInfo()?.camera;
  showPlanButtons();
}

function askForToken() {
  if (house.role === "none" && !byId("login").hidden) return;
  allow("none");
  byId("login").hidden = false;
  note("This page needs a token.");
}

async function logIn(token) {
  const answer = await fetch("/session", token == null ? {} : {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ token }) });
  const told = await answer.json();
  const role = answer.ok ? told.role : "none";
  allow(role);
  byId("login").hidden = role !== "none";
  note(role !== "none" ? null : token == null ? "This page needs a token." : told.parameters?.message);
  return role !== "none";
}

async function begin(token) {
  if (!await logIn(token)) return;
  listen();
  await attempt(loadHistory);
}

function redraw() {
  soon();
  drawCurve();
  showPlan();
}

function bind() {
  bindSliders();
  bindPicture();
  byId("stop").addEventListener("click", stop);
  byId("lens").addEventListener("change", (event) => choose(event.target.value));
  byId("find").addEventListener("click", () => autofocus());
  byId("add-sharp").addEventListener("click", () => addLimit("sharp"));
  byId("add-blurred").addEventListener("click", () => addLimit("blurred"));
  byId("apply").addEventListener("click", applyPlan);
  byId("map").addEventListener("click", () => takeFocusMap());
  byId("stack").addEventListener("click", () => whileBusy(takeStack));
  byId("home").addEventListener("click", () => attempt(() => call("Home", { lens: house.name })));
  byId("reset").addEventListener("click", () => attempt(() => call("ResetFaults", { lens: house.name })));
  byId("limit").addEventListener("input", soon);
  byId("login").addEventListener("submit", (event) => { event.preventDefault(); begin(byId("token").value); });
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && plan.placing) return endPlacing();
    if (event.key === "Escape") return void stop();
    if (event.target.closest("input, select, button, [role=slider], [role=application]") || event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === "n" || event.key === "f") move("focus", { nearer: event.key === "n" ? 10 : -10 });
  });
  // A browser opens six connections to one place: a page that nobody sees takes none of them.
  document.addEventListener("visibilitychange", () => { listen(); look(); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  addEventListener("resize", redraw);
}

bind();
const token = new URLSearchParams(location.hash.slice(1)).get("token");
if (token) history.replaceState(null, "", location.pathname);
begin(token);
