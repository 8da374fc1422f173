"""Pictures of topics for browsers, with the parameters of web_video_server: from messages to JPEG and PNG."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from io import BytesIO
from typing import Literal
from urllib.parse import quote

from rbxcompose.base.dataclass import dataclass
from rbxcompose.msgs.images import WrongPictureError, pixels
from rbxcompose.msgs.sensor_msgs import CompressedImage, Image

IMAGES = (Image.TYPE, CompressedImage.TYPE)
LARGEST = 4096  # pixels of a side
_MOST_PIXELS = LARGEST**2  # to decode or to scale to: a few bytes may stand for gigabytes
_COMPRESSED = ("JPEG", "PNG", "TIFF", "WEBP", "BMP")  # what cameras send; Pillow decodes some others to open them
_FORMS = {"mjpeg": "jpeg", "jpeg": "jpeg", "png": "png", "ros_compressed": "jpeg"}
_QUALITY = {"jpeg": 95, "png": 3}
_QUALITIES = {"jpeg": (1, 100), "png": (0, 9)}


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture as viewers want it; those that want the same share it. A size of 0 is that of the camera."""

    topic: str
    form: Literal["jpeg", "png"]
    width: int
    height: int
    quality: int
    """Of JPEG from 1 to 100; of PNG how hard it is compressed, from 0 to 9."""
    is_inverted: bool
    """Whether it is turned by half a turn."""

    @property
    def mime(self) -> str:
        """Return its media type."""
        return f"image/{self.form}"


def wanted(query: Mapping[str, str]) -> Picture:
    """Return what the parameters of an address ask for.

    Raises:
        WrongPictureError: if they make no sense.
    """
    # Pages put a second `?` and a random number behind an address, against caches: mjpegcanvas does.
    query = {name.partition("?")[0]: value.partition("?")[0] for name, value in query.items()}
    topic = query.get("topic", "").strip()
    if not topic.strip("/"):
        raise WrongPictureError("'topic' is the name of a topic with pictures")
    written = query.get("type", "mjpeg")
    if (form := _FORMS.get(written)) is None:
        raise WrongPictureError(f"'type' is one of {', '.join(_FORMS)}, not '{written[:40]}'")
    return Picture(
        f"/{topic.lstrip('/')}",
        form,  # type: ignore[arg-type]
        _whole(query, "width", 0, (0, LARGEST)),
        _whole(query, "height", 0, (0, LARGEST)),
        _whole(query, "quality", _QUALITY[form], _QUALITIES[form]),
        "invert" in query,
    )


def _whole(query: Mapping[str, str], name: str, otherwise: int, ends: tuple[int, int]) -> int:
    text = query.get(name, "").strip()
    if not text:
        return otherwise
    try:
        value = round(float(text))  # pages compute sizes
    except (ValueError, OverflowError) as error:
        raise WrongPictureError(f"'{name}' is a number") from error
    if not ends[0] <= value <= ends[1]:
        raise WrongPictureError(f"'{name}' is between {ends[0]} and {ends[1]}")
    return value


def viewer_page(query: str) -> str:
    """Return a page that shows a stream of these parameters, as they stand in an address."""
    return f'<!doctype html><html lang="en"><title>Stream</title><img alt="Stream" src="stream?{escape(query)}">'


def list_page(topics: Iterable[str]) -> str:
    """Return a page with links to what can be seen."""
    rows = [
        f'<li>{escape(topic)}: <a href="stream_viewer?topic={quote(topic)}">stream</a>, '
        f'<a href="snapshot?topic={quote(topic)}">snapshot</a></li>'
        for topic in topics
    ]
    shown = f"<ul>{''.join(rows)}</ul>" if rows else "<p>Nothing publishes pictures now.</p>"
    return f'<!doctype html><html lang="en"><title>Streams</title><h1>Streams</h1>{shown}'


def encoded(message: Image | CompressedImage, want: Picture) -> bytes:
    """Return the picture of a message.

    Raises:
        WrongPictureError: if it is none.
    """
    from PIL import Image as Pictures  # of the extra `console`

    if isinstance(message, CompressedImage):
        data = bytes(message.data)
        is_as_wanted = want.form in message.format.lower().replace("jpg", "jpeg") and not (want.width or want.height)
        if is_as_wanted and not want.is_inverted:
            return data
        try:
            header = Pictures.open(BytesIO(data), formats=_COMPRESSED)
            _refuse_large("the compressed picture has", *header.size)
            picture = header.convert("RGB")
        except WrongPictureError:
            raise
        except (OSError, ValueError, SyntaxError, Pictures.DecompressionBombError) as error:
            raise WrongPictureError(f"what is compressed as '{message.format[:40]}' is no picture") from error
    else:
        picture = Pictures.fromarray(pixels(message))
    if want.width or want.height:
        width = want.width or round(picture.width * want.height / picture.height)
        height = want.height or round(picture.height * want.width / picture.width)
        _refuse_large("in this size, the picture would have", width, height)
        picture = picture.resize((max(1, width), max(1, height)), Pictures.Resampling.BILINEAR)
    if want.is_inverted:
        picture = picture.transpose(Pictures.Transpose.ROTATE_180)
    written = BytesIO()
    if want.form == "jpeg":
        picture.save(written, "JPEG", quality=want.quality)
    else:
        picture.save(written, "PNG", compress_level=want.quality)
    return written.getvalue()


def _refuse_large(what: str, width: int, height: int) -> None:
    if width * height > _MOST_PIXELS:
        raise WrongPictureError(f"{what} {width} x {height} pixels; {_MOST_PIXELS} are the most")
