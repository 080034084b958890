// @ts-check
// What all scripts of pages use.

/**
 * Formats a number to `digits` significant digits, without trailing zeros.
 * @param {number | null | undefined} value
 */
function number(value, digits = 5) {
  if (value === null || value === undefined) return "n/a";
  if (value === 0 || (Math.abs(value) >= 1e-4 && Math.abs(value) < 1e6)) return String(Number(value.toPrecision(digits)));
  return value.toExponential(digits - 1).replace(/\.?0+e/, "e").replace("e+", "e");
}

/**
 * Creates an element with attributes and children; text is never parsed as markup.
 * @template {keyof HTMLElementTagNameMap} Name
 * @param {Name} name @param {Record<string, string>} attributes @param {(Node | string)[]} children
 */
function element(name, attributes = {}, ...children) {
  const node = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}
