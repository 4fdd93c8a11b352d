"""The same for asyncio: `async with lensd.aio.Lens(name="cam") as lens: await lens.focus("2m")`."""
from ._aio_lens import Events, Lease, Lens, Presets
from ._aio_streams import Stream, View

__all__ = ["Events", "Lease", "Lens", "Presets", "Stream", "View"]
