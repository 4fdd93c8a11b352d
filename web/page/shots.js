// Pictures that are taken for somebody: those of a stack, and those from which the blur of a plan is measured.
"use strict";

/** One frame of the lens at rest, exposed from now on: {bytes, frame, picture}. */
async function photograph(parameters) {
  const pieces = [];
  let first = null;
  await callMore("Snapshot", { lens: house.name, ...parameters }, (piece) => {
    first ??= piece;
    pieces.push(Uint8Array.from(atob(piece.data), (letter) => letter.charCodeAt(0)));
  });
  const bytes = new Uint8Array(first.size);
  let at = 0;
  for (const piece of pieces) { bytes.set(piece, at); at += piece.length; }
  return { bytes, frame: first.frame, picture: first.picture };
}

/** Samples proportional to light, of a picture as it is. */
function lightOf({ bytes, picture }) {
  const { widthPx: width, heightPx: height, channels, bits, gamma } = picture, wide = bits > 8;
  const sample = (i) => wide ? bytes[2 * i] + 256 * bytes[2 * i + 1] : bytes[i];
  const light = Float64Array.from({ length: width * height }, (_, i) => {
    const value = channels === 1 ? sample(i) : (sample(3 * i) + 2 * sample(3 * i + 1) + sample(3 * i + 2)) / 4;
    return gamma === 1 ? value : value ** gamma;
  });
  return { width, height, light };
}

async function goTo(shot) {
  const there = [];
  if (shot.extensionMm != null && axisInfo("focus")) there.push(["focus", { extensionMm: shot.extensionMm }]);
  if (shot.fNumber != null && axisInfo("iris")) there.push(["iris", { fNumber: shot.fNumber }]);
  for (const { move: moved } of await Promise.all(there.map(([axis, target]) => call("Move", { lens: house.name, axis, target })))) {
    if (!moved.reached) throw new Error(`${moved.axis} did not get there: ${moved.reason || moved.cause}`);
  }
}

// ---- A stack ----------------------------------------------------------------------------------------------------------

const strip = { addresses: [] };

function clearStrip() {
  strip.addresses.forEach((address) => URL.revokeObjectURL(address));
  strip.addresses = [];
  byId("shots").replaceChildren();
}

function addShot(shot, number, count, bytes) {
  const item = document.createElement("li"), figure = document.createElement("figure"), image = document.createElement("img");
  const words = document.createElement("figcaption"), address = URL.createObjectURL(new Blob([bytes], { type: "image/jpeg" }));
  strip.addresses.push(address);
  const range = `sharp from ${distanceText(shot.nearD)} to ${distanceText(shot.farD)}`;
  Object.assign(image, { src: address, alt: `Shot ${number} of ${count}, ${range}` });
  words.textContent = `${number} of ${count}: ${range}, f/${digits(shot.fNumber, 3)}`;
  figure.append(image, words);
  item.append(figure);
  byId("shots").append(item);
}

/** The fewest shots that together keep every sharp limit, one after the other. */
async function takeStack() {
  const told = (text) => { byId("stacked").textContent = text; };
  const lens = house.name;
  clearStrip();
  try {
    const limits = planRequest().limits.filter((limit) => limit.kind === "sharp");
    const { plan: answer } = await call("Plan", { lens, request: { limits, stack: true } });
    if (!answer.feasible || !answer.shots) return told(`There is no stack: ${answer.reason ?? planWords(answer)}`);
    for (const [at, shot] of answer.shots.entries()) {
      told(`Shot ${at + 1} of ${answer.shots.length} …`);
      await goTo(shot);
      const { bytes } = await photograph({ encoding: "jpeg", scaleTo: { widthPx: 640, heightPx: 640 } });
      if (house.name !== lens) return;
      addShot(shot, at + 1, answer.shots.length, bytes);
    }
    told(answer.shots.length === 1 ? "One shot keeps all of it sharp." : `${answer.shots.length} shots together keep all of it sharp.`);
  } catch (failure) {
    told(`The stack ended: ${wordsOf(failure)}.`);
  }
}

// ---- A focus map ------------------------------------------------------------------------------------------------------

/** The picture, and over each region of the grid the distance at which it is in focus. */
function drawMap(map) {
  const canvas = byId("focusmap"), picture = byId("picture"), pen = canvas.getContext("2d");
  [canvas.width, canvas.height] = [picture.width, picture.height];
  if (!view.zoom) pen.drawImage(picture, 0, 0);
  const found = map.cells.filter((cell) => cell.vergenceD != null).map((cell) => cell.vergenceD);
  const [far, near] = [Math.min(...found), Math.max(...found)], size = Math.max(11, canvas.width / map.columns / 6);
  pen.font = `600 ${size}px system-ui`;
  pen.textAlign = "center";
  for (const { region, vergenceD } of map.cells) {
    const [x, y, w, h] = [region.x * canvas.width, region.y * canvas.height, region.w * canvas.width, region.h * canvas.height];
    const part = near > far ? (vergenceD - far) / (near - far) : 0.5;
    pen.fillStyle = vergenceD == null ? "rgb(90 90 90 / .6)" : `hsl(${220 - 190 * part} 75% 40% / .6)`;
    pen.fillRect(x + 1, y + 1, w - 2, h - 2);
    pen.fillStyle = "#fff";
    pen.fillText(vergenceD == null ? "?" : distanceText(vergenceD, 3), x + w / 2, y + h / 2 + size / 3, w - 4);
  }
  canvas.setAttribute("aria-label", found.length === 0 ? "Focus map: no part is known"
    : `Focus map: ${found.length} of ${map.cells.length} parts are known, in focus from ${distanceText(near)} to ${distanceText(far)}`);
  byId("mapped").hidden = false;
}

async function takeFocusMap() {
  const abort = new AbortController(), lens = house.name;
  search.abort?.abort();
  Object.assign(search, { abort, samples: [], result: null, region: null, holding: false });
  byId("mapped").hidden = true;
  byId("found").textContent = "Searching where each part is in focus …";
  await attempt(() => callMore("FocusMap", { lens, columns: 6, rows: 4 }, ({ progress, map }) => {
    if (progress) byId("found").textContent = `Searching where each part is in focus: frame ${progress.frames} of about ${progress.framesExpected} …`;
    if (!map) return;
    byId("found").textContent = `${map.mapped ? "Mapped" : "Refused"}: ${map.reason} (${map.frames} frames, ${digits(map.elapsedMs / 1000, 3)} s)`;
    if (map.cells.length > 0) drawMap(map);
  }, abort.signal).then((last) => answered(last?.map)).catch((failure) => {
    if (failure.name !== "AbortError") byId("found").textContent = "Ended: " + wordsOf(failure);
    throw failure;
  }));
  if (search.abort === abort) search.abort = null;
}

// ---- Blur, measured ---------------------------------------------------------------------------------------------------

/** Smallest and largest blur that the thin lens has between the two ends of a limit, in px. */
function blurRangePx(limit, f, n, e) {
  const ends = [limit.nearD, limit.farD].map((u) => optics.blurUm(f, n, e, u) / pixelUm());
  return [ends[0] * ends[1] <= 0 ? 0 : Math.min(...ends.map(Math.abs)), Math.max(...ends.map(Math.abs))];
}

/** Exposes so much longer as the aperture is smaller, as far as the camera goes. */
async function exposeFor(times, exposure) {
  if (!exposure.canSetExposure || !(exposure.exposureMs > 0)) return;
  const longest = Math.min(exposure.exposureMaxMs ?? Infinity, 500);
  await call("SetExposure", { lens: house.name, exposureMs: Math.max(exposure.exposureMs, Math.min(longest, exposure.exposureMs * times)) });
}

/**
 * The blur in each place that a limit has in the picture: taken as the lens stands, then twice with the aperture closed to a
 * quarter, which makes a quarter of the blur.
 */
async function measureBlur() {
  const wanted = plan.limits.filter((limit) => limit.place), known = lensInfo()?.optics, before = lensState();
  if (wanted.length === 0 || !known || !axisInfo("iris") || !lensInfo().camera) return;
  const n = before.fNumber, small = Math.min(known.fNumberMax, 4 * n);
  if (!(small > 1.3 * n)) {
    plan.done += " Blur is not measured: the aperture cannot be made much smaller to compare with.";
    return showPlan();
  }
  const told = plan.done, { exposure } = await call("GetExposure", { lens: house.name });
  const all = (parameters) => photograph({ encoding: "raw", ...parameters });
  plan.done = `${told} Measuring blur: the aperture closes for a moment …`;
  showPlan();
  try {
    const pictures = [];
    for (const limit of wanted) pictures.push([await all({ region: limit.place })]);
    const frame = pictures[0][0].frame;
    await goTo({ fNumber: small });
    await exposeFor((small / n) ** 2, exposure);
    for (const [at, limit] of wanted.entries()) {
      for (let i = 0; i < 2; ++i) pictures[at].push(await all({ region: limit.place }));
    }
    for (const [at, limit] of wanted.entries()) {
      const [seen, ...sharps] = pictures[at].map(lightOf), ratio = frame.fNumber / pictures[at][1].frame.fNumber;
      limit.measured = blurOf(seen, sharps, ratio) ?? { px: null };
      limit.planned = blurRangePx(limit, focalMm(), frame.fNumber, frame.extensionMm);
    }
    plan.done = `${told} Blur measured beside planned: see the limits and the picture.`;
  } catch (failure) {
    plan.done = `${told} Blur was not measured: ${wordsOf(failure)}.`;
  } finally {
    if (exposure.canSetExposure && exposure.exposureMs > 0) await call("SetExposure", { lens: house.name, exposureMs: exposure.exposureMs }).catch(() => {});
    await goTo({ fNumber: n }).catch((failure) => { plan.done += ` The aperture did not open again: ${wordsOf(failure)}.`; });
    showPlan();
  }
}

/** "measured 1.7 ± 0.1 px, planned 0.4 to 1.9 px". */
function measuredText(limit) {
  if (!limit.measured) return "";
  const planned = limit.planned.map((px) => digits(px, 2)), range = planned[0] === planned[1] ? planned[0] : planned.join(" to ");
  const seen = limit.measured.px == null ? "too little to be seen there" : `${digits(limit.measured.px, 2)} ± ${digits(limit.measured.sigmaPx, 1)} px`;
  const off = limit.measured.px != null && Math.max(limit.planned[0] - limit.measured.px, limit.measured.px - limit.planned[1]) > 1;
  return `measured ${seen}, planned ${range} px${off ? ": what is there may be at another distance" : ""}`;
}
