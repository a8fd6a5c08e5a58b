// Numbers with their units, for reading.

const PREFIXES = [[1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];
const PREFIXED = ["m", "s", "N", "V", "J", "Hz", "g", "W", "A", "C", "F", "m/s", "N/s", "N/m"];

/** A value with its unit under a prefix, such as "12.5 µm"; by a power of ten where the unit takes no prefix. */
function amount(value, unit, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  if (!PREFIXED.includes(unit)) {
    const plain = value === 0 || (Math.abs(value) >= 1e-3 && Math.abs(value) < 1e6);
    const text = plain ? `${Number(value.toPrecision(digits))}` : value.toExponential(digits - 1).replace(/\.?0*e/, "e").replace("e+", "e");
    return `${text}${unit === "1" ? "" : ` ${unit}`}`.replace(/-/g, "−");
  }
  const size = Math.abs(value);
  if (size < 1e-21) return `0 ${unit}`;
  const [step, prefix] = PREFIXES.find(([least]) => size >= least * 0.9995) || PREFIXES[PREFIXES.length - 1];
  return `${Number((value / step).toPrecision(digits))} ${prefix}${unit}`.replace("-", "−");
}
