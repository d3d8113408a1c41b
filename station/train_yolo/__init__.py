"""Training the model that the detector `yolo` proposes places with: `python -m station.train_yolo --help`. Needs the extra `train`."""
