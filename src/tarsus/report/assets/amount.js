// Numbers with their units, for reading.

const PREFIXES = [[1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];
const PREFIXED = ["m", "s", "N", "V", "J", "Hz", "g", "W", "A", "C", "F", "m/s", "N/s", "N/m"];

const between = (value, least, most) => Math.min(Math.max(value, least), most);
const minus = (text) => text.replace("-", "−");
const raised = (power) => power.replace(/./g, (sign) => (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(sign)]));

/** A number, with a power of ten where it is far from 1; nothing where there is none. */
function plain(value, digits = 4) {
  if (value === null || value === undefined) return "";
  const size = Math.abs(value);
  if (size === 0 || (size >= 1e-4 && size < 1e6)) return minus(`${Number(value.toPrecision(digits))}`);
  const [mantissa, power] = value.toExponential(digits - 1).split("e"), factor = minus(`${Number(mantissa)}`);
  return `${factor === "1" ? "" : `${factor}·`}10${raised(power.replace("+", ""))}`;
}

/** A value with its unit under a prefix, such as "12.5 µm"; by a power of ten where the unit takes no prefix. */
function amount(value, unit, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  if (!PREFIXED.includes(unit)) return `${plain(value, digits)}${unit === "1" ? "" : ` ${unit.replace(/\^(-?\d+)/g, (_, power) => raised(power))}`}`;
  const size = Math.abs(value);
  if (size < 1e-21) return `0 ${unit}`;
  const [step, prefix] = PREFIXES.find(([least]) => size >= least * 0.9995) || PREFIXES[PREFIXES.length - 1];
  return `${minus(`${Number((value / step).toPrecision(digits))}`)} ${prefix}${unit}`;
}
