#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Checks the built manual in a browser with windows of 1280 and 400 pixels.

No element may extend beyond the right edge of the window unless it can be scrolled (code, wide
tables, displayed formulas), and no page may load anything from a network.

    python3 -m venv build/pages && build/pages/bin/pip install playwright   (and Debian's chromium)
    build/pages/bin/python tools/check_pages.py build/doc [page...]

The check is not part of the tests, since a browser is large. The exit status is 1 if a page fails.
"""

import glob
import os
import sys

from playwright.sync_api import sync_playwright

# Returns elements beyond the right edge that no ancestor scrolls.
BEYOND = """() => {
  const width = document.documentElement.clientWidth, beyond = [];
  for (const element of document.querySelectorAll('.rst-content *')) {
    // formulas count by their drawing, not by the hidden MathML next to it
    const formula = element.closest('.MathJax_SVG');
    if (formula && element.tagName != 'svg') continue;
    const box = element.getBoundingClientRect();
    // text without a break extends beyond its box
    const right = element.clientWidth > 0 ? Math.max(box.right, box.left + element.scrollWidth)
                                          : box.right;
    if (box.width == 0 || right <= width + 1) continue;
    let scrolls = false;
    for (let up = element.parentElement; up && !up.classList.contains('wy-nav-content');
         up = up.parentElement)
      scrolls = scrolls || ['auto', 'scroll', 'hidden'].includes(getComputedStyle(up).overflowX);
    if (!scrolls && !['auto', 'scroll'].includes(getComputedStyle(element).overflowX))
      beyond.push(element.tagName + ': ' + element.textContent.slice(0, 60));
  }
  return beyond;
}"""
FORMULAS = ("() => new Promise(done => "
            "window.MathJax && MathJax.Hub ? MathJax.Hub.Queue(done) : done())")


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    pages = [os.path.join(sys.argv[1], name + ".html")
             for name in sys.argv[2:]] or sorted(glob.glob(os.path.join(sys.argv[1], "*.html")))
    failed = 0
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium",
                                             args=["--no-sandbox"])
        for width in (1280, 400):
            window = browser.new_page(viewport={"width": width, "height": 900})
            asked = []
            window.on(
                "request", lambda request: asked.append(request.url)
                if request.url.startswith("http") else None)
            for path in pages:
                window.goto("file://" + os.path.abspath(path))
                window.wait_for_timeout(300)
                window.evaluate(FORMULAS)
                beyond = window.evaluate(BEYOND)
                for what in beyond[:5] + asked:
                    print(f"{os.path.basename(path)} at {width} pixels: {what}")
                failed += bool(beyond) + bool(asked)
                asked.clear()
            window.close()
        browser.close()
    print(f"{len(pages)} pages, {failed} with faults")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
