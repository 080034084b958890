// @ts-check
// Makes tables sortable by a click on a column header: numbers by value, text alphabetically. Labels the cells of wide tables,
// which narrow screens show as cards.
(() => {
  "use strict";
  /** @param {string} text */
  const number = (text) => (/^\s*[-+]?\.?\d/.test(text) ? parseFloat(text) : null);
  /** @param {HTMLTableRowElement} row @param {number} column */
  const value = (row, column) => row.cells[column].dataset.value ?? row.cells[column].textContent;

  /** @param {string} a @param {string} b */
  function order(a, b) {
    const [x, y] = [number(a), number(b)];
    if (x === y) return a.localeCompare(b);
    return x === null ? 1 : y === null ? -1 : x - y; // cells without a number come last
  }

  /** @param {HTMLTableElement} table @param {number} column @param {HTMLTableCellElement} header */
  function sortBy(table, column, header) {
    const descending = header.getAttribute("aria-sort") === "ascending";
    for (const other of table.tHead?.rows[0].cells ?? []) other.removeAttribute("aria-sort");
    header.setAttribute("aria-sort", descending ? "descending" : "ascending");
    const rows = [...table.tBodies[0].rows].sort((a, b) => order(value(a, column), value(b, column)));
    table.tBodies[0].append(...(descending ? rows.reverse() : rows));
  }

  /**
   * Labels every cell with its header. Matrices and fronts stay tables, as their columns are compared.
   * @param {HTMLTableElement} table @param {HTMLTableCellElement[]} heads
   */
  function label(table, heads) {
    if (heads.length <= 4 || table.matches(".front") || table.querySelector(".shade")) return;
    table.classList.add("cards");
    for (const row of table.tBodies[0].rows) {
      [...row.cells].forEach((cell, i) => {
        if (cell.tagName === "TD") cell.dataset.label = heads[i].textContent;
        // The value at the reported point and whether the demand is met come first.
        if (cell.querySelector("strong") || heads[i].textContent === "met") cell.classList.add("key");
      });
    }
  }

  for (const table of document.querySelectorAll("table")) {
    const body = table.tBodies[0];
    if (table.tHead?.rows.length !== 1 || table.tBodies.length !== 1) continue;
    const heads = [...table.tHead.rows[0].cells];
    if ([...body.rows].some((row) => row.cells.length !== heads.length)) continue;
    label(table, heads);
    if (body.rows.length < 2) continue;
    heads.forEach((head, column) => {
      if (!head.textContent) return;
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => sortBy(table, column, head));
    });
  }
})();
