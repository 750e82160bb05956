// A finger is pressed 1 mm onto a plane, which then slides by 5 mm. The sketch prints normal force, friction and slip
// margin every 50 ms, as columns for the serial plotter. The model lies in flash.
#include <fingerpad.h>
#include <fingertip_fpm.h>

static fingerpad_model model;
static fingerpad_state finger;
static int32_t code;
static int step_number;

void setup() {
  Serial.begin(115200);
  code = fingerpad_model_load(&model, (const uint8_t *)fingertip_fpm, FINGERTIP_FPM_BYTES);
  if (code == FINGERPAD_OK) {
    code = fingerpad_state_init(&finger);
  }
  Serial.println(fingerpad_error_text(code));
}

void loop() {
  // A sketch with sensors measures the depth and the slide since the last step here.
  const float depth_mm = step_number < 1000 ? 0.001f * step_number : 1.0f;
  const float slide_mm = step_number < 1000 || step_number >= 6000 ? 0.0f : 0.001f;
  const fingerpad_motion motion = {depth_mm, slide_mm, 0.0f, 0.0f, 1e-3f};
  fingerpad_response r;
  if (code == FINGERPAD_OK) {
    code = fingerpad_step(&model, &finger, motion, &r);
  }
  if (code != FINGERPAD_OK) {
    Serial.println(fingerpad_error_text(code));
    delay(1000);
    return;
  }
  if (step_number % 50 == 0) {
    Serial.print(r.normal_force_n, 4);
    Serial.print('\t');
    Serial.print(r.friction_x_n, 4);
    Serial.print('\t');
    Serial.println(r.slip_margin, 3);
  }
  step_number++;
  delay(1);
}
