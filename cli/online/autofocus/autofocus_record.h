// The frames of one autofocus in a folder, and what a replay of them needs to know of the lens
// (docs/autofocus-measured.md, "Recordings and replays").
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "cli/link/daemon_client.h"
#include "io/png.h"

namespace lensd::cli {

/// How one frame was taken.
struct FrameMark {
  std::int64_t exposure_start_ns = 0;  ///< what the samples of an AutofocusResult name it by
  int bits = 8;                        ///< significant bits a sample
  double gamma = 1.0;
  varlink::Json extension_mm;  ///< null where it is not known
};

/// Any thread may save frames; the others are its owner's.
class Recording {
 public:
  /// Makes the folder. One that holds something already is refused: frames of two runs must not be mixed.
  /// `parameters`: of Autofocus or AutofocusBegin.
  static std::expected<std::unique_ptr<Recording>, Failure> Create(DaemonClient& link, std::string folder,
                                                                   varlink::Json parameters);
  /// Removes pictures that Finish() has not made frames of the run.
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;
  /// Grey pictures of one size, in the order of their exposures. They stay in memory while there is room, since a view
  /// drops what is not taken from it in time.
  Result<void> Save(io::Image image, const FrameMark& mark);
  /// Waits until the frames that the result names are there, or a later one, at most for `patience`.
  void Await(const varlink::Json& result, Duration patience);
  /// Names the frames of the run and writes run.json. Returns how many are missing.
  std::expected<int, Failure> Finish(const varlink::Json& result);

  const varlink::Json& lens() const { return info_; }

 private:
  struct Kept {
    FrameMark mark;
    io::Image image;   ///< without samples where it is in `file`
    std::string file;  ///< empty: in memory
  };
  Recording(std::string folder, varlink::Json parameters, varlink::Json info, varlink::Json f_number)
      : folder_(std::move(folder)),
        parameters_(std::move(parameters)),
        info_(std::move(info)),
        f_number_(std::move(f_number)) {}
  Result<varlink::Json> FramesOf(const varlink::Json& result);
  varlink::Json SearchOf(const varlink::Json& frames) const;

  std::string folder_;
  varlink::Json parameters_;
  varlink::Json info_;      ///< LensInfo
  varlink::Json f_number_;  ///< null where it is not known
  std::mutex mutex_;
  std::condition_variable saved_;
  std::map<std::int64_t, Kept> kept_;  ///< by the beginning of the exposure
  std::size_t samples_ = 0;            ///< in memory
};

/// Saves every frame that the lens' own camera shows, on a thread of its own, until it is destroyed.
class ViewRecorder {
 public:
  /// Returns when the first frame is there: whatever the camera takes from now on is saved.
  static std::expected<std::unique_ptr<ViewRecorder>, Failure> Start(const Session& session, Recording& recording);
  ~ViewRecorder();
  ViewRecorder(const ViewRecorder&) = delete;
  ViewRecorder& operator=(const ViewRecorder&) = delete;
  /// Why it ended, if it did.
  std::optional<Error> trouble();

 private:
  ViewRecorder(varlink::Client client, Recording& recording);
  void Run();
  Result<void> TakePicture();

  varlink::Client client_;
  Recording& recording_;
  int stop_ = -1;  ///< an eventfd that ends the wait for a picture
  std::mutex mutex_;
  std::condition_variable changed_;
  bool begun_ = false;
  std::optional<Error> trouble_;
  std::thread thread_;
};

}  // namespace lensd::cli
