"""The explorer: a local page on which gains are turned and the region moves.

`server.py` serves pages on this machine alone, `page.py` is one of them and `state.py` what it
shows, as one value. `controls.py` is what can be turned, `form.py` what the browser is told of it;
`computed.py` what is computed, slice by slice, `work.py` when; `figures.py` the pictures, which
`draw.js` draws; `page.html`, `page.css` and `page.js` what the browser has beside them.
"""
