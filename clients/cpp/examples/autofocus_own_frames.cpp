// Autofocus with the frames of a camera of one's own. Here a second connection to lensd plays that camera: in its place
// stands whatever exposes a new frame and gives its pixels.
#include <lensd/client.h>

#include <cstdio>

int main(int argc, char** argv) {
  if (argc < 3) return 64;
  lensd::Client client(argv[1]), camera(argv[1]);
  lensd::Picture picture;  // its pixels must stay until the next frame is asked for
  const auto grab = [&](const lensd::AutofocusStep&) {
    picture = camera.Snapshot(lensd::SnapshotParameters().lens(argv[2]).encoding("gray8"));
    const lensd::PictureInfo info = picture.info();
    return lensd::Frame(picture.data(), static_cast<int>(info.widthPx()), static_cast<int>(info.heightPx()))
        .gamma(info.gamma());
  };
  const lensd::AutofocusResult result =
      client.Autofocus(lensd::AutofocusBeginParameters().lens(argv[2]).pixelUm(3.45), grab);
  std::printf("%s after %lld frames: %s\n", result.focused() ? "focused" : "refused",
              static_cast<long long>(result.frames()), result.reason().c_str());
  if (result.focused() && result.vergenceD()) std::printf("at %.3f m\n", 1 / *result.vergenceD());
  return result.focused() ? 0 : 1;
}
