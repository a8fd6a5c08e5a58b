// Light or dark: what the reader chose before, else what the system asks for. Paper is always light.
(() => {
"use strict";
const root = document.documentElement, system = matchMedia("(prefers-color-scheme: dark)");
let chosen = null;
try { chosen = localStorage.getItem("tarsus-theme"); } catch { /* pages of files may have no storage */ }
const dark = () => (chosen ? chosen === "dark" : system.matches);
function show(theme) {
  root.dataset.theme = theme || (dark() ? "dark" : "light");
  const button = document.getElementById("theme");
  if (button) button.textContent = dark() ? "Light" : "Dark";
  dispatchEvent(new Event("themechange"));
}
show();
system.addEventListener("change", () => show());
addEventListener("beforeprint", () => {
  show("light");
  document.querySelectorAll("details:not([open])").forEach((one) => { one.open = one.unfolded = true; });
});
addEventListener("afterprint", () => {
  show();
  document.querySelectorAll("details").forEach((one) => { if (one.unfolded) one.open = one.unfolded = false; });
});
addEventListener("DOMContentLoaded", () => {
  const button = document.getElementById("theme");
  button.hidden = false;
  button.setAttribute("aria-label", "Change between light and dark");
  button.addEventListener("click", () => {
    chosen = dark() ? "light" : "dark";
    try { localStorage.setItem("tarsus-theme", chosen); } catch { /* as above */ }
    show();
  });
  show();
});
})();
