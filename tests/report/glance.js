// What a reader would see at a glance that is wrong with a page: `glance`, called in the page itself.
(() => {
"use strict";
let faults = [];
const at = (what) => `${what.slice(0, 60)}`;

const seen = (element) => element.checkVisibility({ checkOpacity: true, checkVisibilityCSS: true });
const beyond = (inner, outer, by) =>
  inner.left < outer.left - by || inner.right > outer.right + by || inner.top < outer.top - by || inner.bottom > outer.bottom + by;

/** Boxes of all text that is seen: its lines, without what is scrolled away. */
function boxes() {
  const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const parent = node.parentElement, text = node.data.trim();
    if (!text || parent.closest("script, style, noscript, option, title, .skip") || !seen(parent)) continue;
    const drawn = parent.closest("svg text"), range = document.createRange();
    range.selectNodeContents(node);
    const rects = drawn ? [parent.getBoundingClientRect()] : [...range.getClientRects()];
    for (const { left, right, top, bottom } of rects) {
      const box = { left, right, top, bottom, text, parent, drawn };
      if (right - left > 1 && bottom - top > 1 && shownOf(box)) found.push(box);
    }
  }
  return found;
}

/** Whether some of a box is within all that scrolls around it; text that is cut where nothing scrolls is a fault. */
function shownOf(box) {
  for (let one = box.parent; one && one !== document.body; one = one.parentElement) {
    const style = getComputedStyle(one), frame = one.getBoundingClientRect();
    const scrolls = /auto|scroll/.test(style.overflowX + style.overflowY);
    const outside = box.right <= frame.left || box.left >= frame.right || box.bottom <= frame.top || box.top >= frame.bottom;
    if (scrolls && outside) return false;
    if (scrolls) {
      box.left = Math.max(box.left, frame.left);
      box.right = Math.min(box.right, frame.right);
      box.top = Math.max(box.top, frame.top);
      box.bottom = Math.min(box.bottom, frame.bottom);
    } else if ((style.overflowX === "hidden" || one.tagName === "svg") && beyond(box, frame, 2)) {
      faults.push(`cut: ${at(box.text)}`);
    }
  }
  return true;
}

const overlap = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 2 && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 3;

function overlapping(all) {
  all.sort((a, b) => a.top - b.top);
  all.forEach((a, i) => {
    for (let j = i + 1; j < all.length && all[j].top < a.bottom; j++) {
      const b = all[j], fixed = (one) => one.parent.closest(".contents, thead");
      if (overlap(a, b) && !fixed(a) && !fixed(b)) faults.push(`over each other: ${at(a.text)} | ${at(b.text)}`);
    }
  });
}

const parts = (color) => color.match(/[\d.]+/g).map(Number);
function luminance([r, g, b]) {
  const [x, y, z] = [r, g, b].map((part) => (part / 255 <= 0.03928 ? part / 255 / 12.92 : ((part / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * x + 0.7152 * y + 0.0722 * z;
}
function ground(element) {
  for (let one = element; one; one = one.parentElement) {
    const color = parts(getComputedStyle(one).backgroundColor);
    if (color.length === 3 || color[3] > 0.5) return color;
  }
  return [255, 255, 255];
}
function faint(all) {
  const known = new Set();
  for (const { parent, drawn, text } of all) {
    if (known.has(parent)) continue;
    known.add(parent);
    const style = getComputedStyle(parent), ink = parts(drawn ? style.fill : style.color);
    if (drawn && ["rgb(26, 26, 26)", "rgb(253, 253, 253)"].includes(style.fill)) continue; // on fields of their own colour
    const [a, b] = [luminance(ink), luminance(ground(parent))], ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    const large = !drawn && parseFloat(style.fontSize) >= 24;
    if (ratio < (large ? 3 : 4.5)) faults.push(`faint (${ratio.toFixed(2)}): ${at(text)}`);
    const sharp = drawn ? parent.getScreenCTM().a ** 2 + parent.getScreenCTM().b ** 2 : 1;
    if (parseFloat(style.fontSize) * Math.sqrt(sharp) < 7.5) faults.push(`tiny (${(parseFloat(style.fontSize) * Math.sqrt(sharp)).toFixed(1)} px): ${at(text)}`);
  }
}

/** Tables that are cut, and do not show that they scroll: by more than their collapsed borders, which are counted but not scrolled to. */
function barless() {
  for (const one of document.querySelectorAll(".table")) {
    const down = one.scrollHeight > one.clientHeight + 1, across = one.scrollWidth > one.clientWidth + 3, edge = parseFloat(getComputedStyle(one).borderTopWidth);
    if (!seen(one)) continue;
    if (down && one.offsetWidth - one.clientWidth - 2 * edge < 6) faults.push(`cut below without a bar: ${at(one.textContent.trim())}`);
    if (across && one.offsetHeight - one.clientHeight - 2 * edge < 6) faults.push(`cut at its side without a bar: ${at(one.textContent.trim())}`);
  }
}

/** Titles of tables that are broken though there is room: narrower than two thirds of what the table stands in. */
function squeezed() {
  for (const one of document.querySelectorAll("caption")) {
    if (!seen(one)) continue;
    const range = document.createRange(), room = one.closest("table").parentElement.clientWidth;
    range.selectNodeContents(one);
    const lines = new Set([...range.getClientRects()].map((line) => Math.round(line.top))).size;
    if (lines > 1 && one.getBoundingClientRect().width < (2 / 3) * room) faults.push(`squeezed: ${at(one.textContent.trim())}`);
  }
}

/** What those need who do not see the page, or have no mouse. */
function reachable() {
  const name = (one) => one.getAttribute("aria-label") || one.labels?.[0]?.textContent || one.textContent;
  for (const one of document.querySelectorAll("button, input, select, a[href], summary")) {
    if (!one.hidden && !name(one).trim()) faults.push(`no name: ${one.outerHTML.slice(0, 60)}`);
  }
  for (const one of document.querySelectorAll("svg, canvas")) {
    const hidden = one.closest("[aria-hidden=true]") || one.closest(".u-wrap");
    if (!hidden && !(one.getAttribute("aria-label") || "").trim()) faults.push(`no words for a picture: ${one.outerHTML.slice(0, 60)}`);
  }
  for (const one of document.querySelectorAll("main *")) {
    const scrolls = /auto|scroll/.test(getComputedStyle(one).overflowX) && one.scrollWidth > one.clientWidth + 1;
    if (scrolls && seen(one) && one.tabIndex < 0) faults.push(`scrolls but not by keys: ${one.outerHTML.slice(0, 60)}`);
  }
  const levels = [...document.querySelectorAll("h1, h2, h3, h4")].map((one) => Number(one.tagName[1]));
  if (levels.filter((level) => level === 1).length !== 1 || levels.some((level, i) => level > (levels[i - 1] || 0) + 1)) faults.push(`headings: ${levels}`);
  if (document.documentElement.lang !== "en") faults.push("no language");
}

/** Tables without numbers, figures without lines, keys without words. */
function empty() {
  const where = (one) => at(one.closest(".table")?.getAttribute("aria-label") || one.getAttribute("aria-label") || one.className || one.tagName);
  for (const one of document.querySelectorAll("table")) {
    if (seen(one) && ![...one.querySelectorAll("tbody td")].some((cell) => cell.textContent.trim())) faults.push(`empty table: ${where(one)}`);
  }
  for (const one of document.querySelectorAll("canvas")) if (seen(one) && !one.closest(".u-wrap") && !ink(one)) faults.push(`empty picture: ${where(one)}`);
  for (const one of document.querySelectorAll("svg[role=img]")) if (seen(one) && !one.querySelector("path, use, image, polygon, circle, rect")) faults.push(`empty picture: ${where(one)}`);
  for (const figure of document.querySelectorAll(".charts")) {
    if (!seen(figure)) continue;
    for (const key of figure.querySelectorAll(".names button, .names .sign")) if (seen(key) && !key.innerText.trim()) faults.push(`a key without words: ${where(key)}`);
    figure.built.plots.forEach((plot, i) => {
      const { bars, shaded, levels } = figure.built.spec.panels[i], drawn = plot.data.slice(1).map((row) => row.some(Number.isFinite));
      if (![...drawn, bars.length, shaded.length, levels.length].some(Boolean)) faults.push(`empty figure: ${where(figure)}, panel ${i}`);
      for (const key of figure.built.panels[i].querySelectorAll(".names button")) {
        if (seen(key) && !key.dataset.lines.split(" ").some((line) => drawn[line - 1])) faults.push(`a key of no line: ${key.innerText}`);
      }
      cramped(plot, where(figure));
    });
  }
}

/** Numbers along the axes of a figure that touch each other. */
function cramped(plot, where) {
  plot.axes.forEach(({ _show, _splits, _values, _rotate, font }, side) => {
    if (!_show || !_splits) return;
    const size = parseFloat(font[0]) / devicePixelRatio, scale = side ? "y" : "x", upright = _rotate === -90;
    const words = _splits.map((split, k) => [plot.valToPos(split, scale), `${_values[k] ?? ""}`]).filter(([place, text]) => text && Number.isFinite(place)).sort(([a], [b]) => a - b);
    for (let k = 1; k < words.length; k++) {
      const room = side || upright ? 0.95 * size : 0.27 * size * (words[k - 1][1].length + words[k][1].length) + 3;
      if (words[k][0] - words[k - 1][0] < room) { faults.push(`cramped: ${words[k - 1][1]} | ${words[k][1]} in ${where}`); return; }
    }
  });
}

/** Opens all that is folded; the height of the page before. */
window.unfold = () => {
  const height = document.documentElement.scrollHeight;
  document.querySelectorAll("details").forEach((one) => { one.open = true; });
  return height;
};

/** Everything that is wrong with the page as it is shown now. */
window.glance = () => {
  faults = [];
  document.querySelectorAll(".zoom").forEach((one) => { one.style.opacity = 1; }); // as where one points at it
  const wide = document.documentElement.scrollWidth;
  if (wide > innerWidth) faults.push(`the page is ${wide} px wide in ${innerWidth}`);
  const all = boxes();
  overlapping(all);
  faint(all);
  squeezed();
  barless();
  reachable();
  empty();
  return { texts: all.length, faults: [...new Set(faults)] };
};
})();
