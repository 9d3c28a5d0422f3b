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
    document.querySelectorAll(".subject").forEach((subject) => {
      let shown = 0;
      subject.querySelectorAll("tbody tr").forEach((row) => {
        row.hidden = Boolean(button.dataset.show) && !row.classList.contains(button.dataset.show);
        shown += row.hidden ? 0 : 1;
      });
      subject.hidden = shown === 0;
      subject.open = Boolean(button.dataset.show) && shown > 0;
    });
  });
});
// A link to a figure or a subject opens it.
const reveal = () => {
  const target = location.hash && document.querySelector(location.hash);
  if (target) target.querySelectorAll("details.figure").forEach((each) => { each.open = true; });
};
window.addEventListener("hashchange", reveal);
reveal();
const markWide = () => document.querySelectorAll(".frame").forEach((frame) => {
  const inner = frame.querySelector(".scroll");
  frame.classList.toggle("wide", inner.scrollWidth > inner.clientWidth + 2);
});
document.querySelectorAll("details").forEach((each) => each.addEventListener("toggle", markWide));
window.addEventListener("resize", markWide);
markWide();
// Paper has no clicks: what belongs there is opened, and closed again afterwards.
window.addEventListener("beforeprint", () => {
  document.querySelectorAll("details.printed:not([open])").forEach((each) => {
    each.open = true;
    each.dataset.closed = "";
  });
});
window.addEventListener("afterprint", () => {
  document.querySelectorAll("details[data-closed]").forEach((each) => {
    each.open = false;
    delete each.dataset.closed;
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
