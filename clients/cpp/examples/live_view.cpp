// A live view in an event loop: pictures as they come, at most so many a second, without copying a pixel.
#include <lensd/client.h>
#include <poll.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  if (argc < 5) return 64;
  using Clock = std::chrono::steady_clock;
  lensd::Client client(argv[1]);
  lensd::View view =
      client.OpenView(lensd::ViewParameters().lens(argv[2]).maxRateHz(std::atof(argv[3])).encoding("gray8"));
  const auto begun = Clock::now();
  const std::chrono::duration<double> wanted(std::atof(argv[4]));
  int count = 0;
  while (Clock::now() - begun < wanted && !view.ended()) {
    pollfd wait{view.fd(), POLLIN, 0};
    poll(&wait, 1, static_cast<int>(view.left().count()));  // a program waits for its own things here too
    while (const std::optional<lensd::Picture> picture = view.Process()) {
      const lensd::PictureInfo info = picture->info();
      const std::size_t middle = static_cast<std::size_t>(info.heightPx() / 2 * info.widthPx() + info.widthPx() / 2);
      if (count++ % 30 == 0) {
        std::printf("frame %lld: %lld x %lld, middle %d\n", static_cast<long long>(picture->frame().sequence()),
                    static_cast<long long>(info.widthPx()), static_cast<long long>(info.heightPx()),
                    picture->data()[middle]);
      }
    }
  }
  std::printf("%.1f pictures a second\n", count / std::chrono::duration<double>(Clock::now() - begun).count());
}
