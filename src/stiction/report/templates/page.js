document.querySelectorAll(".zoom").forEach((link) => {
  link.addEventListener("click", (event) => {
    event.preventDefault();
    link.classList.toggle("large");
  });
});
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") {
    document.querySelectorAll(".zoom.large").forEach((link) => link.classList.remove("large"));
  }
});
const buttons = document.querySelectorAll(".filter button");
buttons.forEach((button) => {
  button.addEventListener("click", () => {
    buttons.forEach((other) => other.setAttribute("aria-pressed", String(other === button)));
    document.querySelectorAll(".claims").forEach((table) => {
      let shown = 0;
      table.querySelectorAll("tbody tr").forEach((row) => {
        row.hidden = Boolean(button.dataset.show) && !row.classList.contains(button.dataset.show);
        shown += row.hidden ? 0 : 1;
      });
      table.hidden = shown === 0;
      table.previousElementSibling.hidden = shown === 0;
    });
  });
});
// A click on a column's head sorts by it, numbers as numbers.
const value = (row, column) => {
  const text = row.cells[column].textContent.trim().replace(/\u2212/g, "-").replace(/,/g, "");
  const number = parseFloat(text);
  return Number.isNaN(number) ? text : number;
};
document.querySelectorAll(".numbers").forEach((table) => {
  table.querySelectorAll("th").forEach((head, column) => {
    head.addEventListener("click", () => {
      const falling = head.getAttribute("aria-sort") === "ascending";
      table.querySelectorAll("th").forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", falling ? "descending" : "ascending");
      const rows = [...table.tBodies[0].rows];
      rows.sort((a, b) => {
        const [left, right] = [value(a, column), value(b, column)];
        const order = typeof left === typeof right
          ? (left > right) - (left < right)
          : String(left).localeCompare(String(right));
        return falling ? -order : order;
      });
      table.tBodies[0].append(...rows);
    });
  });
});
window.addEventListener("beforeprint", () => {
  document.querySelectorAll("details.printed").forEach((part) => { part.open = true; });
});
