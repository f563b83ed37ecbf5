"use strict";
// What mdBook's pages lack for a keyboard.

// A block that scrolls sideways is reached by the tabulator key.
function reachScrollers() {
  for (const block of document.querySelectorAll(".table-wrapper, pre > code")) {
    if (block.scrollWidth > block.clientWidth) block.tabIndex = 0; else block.removeAttribute("tabindex");
  }
}

reachScrollers();
window.addEventListener("resize", reachScrollers);
document.fonts.ready.then(reachScrollers);

// The button of the contents is not the label of the check box that opens them (`xtask/src/site/theme.rs`).
document.getElementById("mdbook-sidebar-toggle").addEventListener("click", () => document.getElementById("mdbook-sidebar-toggle-anchor").click());
