// lens-bench verify: does a picture keep its blur limits? Judged from frames alone.
#pragma once

namespace lensd::bench {

int RunVerify(int argc, char** argv);

}  // namespace lensd::bench
