// Owners of the GigE library's objects and errors, which are only named here.
#pragma once

#include <memory>
#include <string>

struct _ArvBuffer;
struct _ArvCamera;
struct _ArvDevice;
struct _ArvStream;
struct _GError;

namespace zeropose {

struct UnrefObject {
  void operator()(void* object) const;
};
template <class Object>
using GigeOwner = std::unique_ptr<Object, UnrefObject>;

// What a call into the library reports: give it out(), then look.
class GigeError {
 public:
  GigeError() = default;
  ~GigeError() { clear(); }
  GigeError(const GigeError&) = delete;
  GigeError& operator=(const GigeError&) = delete;
  // For the next call; forgets the last one.
  _GError** out() {
    clear();
    return &error_;
  }
  explicit operator bool() const { return error_ != nullptr; }
  std::string text() const;

 private:
  void clear();
  _GError* error_ = nullptr;
};

}  // namespace zeropose
