"""live_view: a page in the browser that shows the running simulator."""
