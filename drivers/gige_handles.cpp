#include "drivers/gige_handles.h"

#include <glib-object.h>

namespace zeropose {

void UnrefObject::operator()(void* object) const { g_object_unref(object); }

std::string GigeError::text() const { return error_->message; }

void GigeError::clear() { g_clear_error(&error_); }

}  // namespace zeropose
