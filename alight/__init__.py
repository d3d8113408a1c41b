"""The toolkit that every process stands on: geometry and runtime. No process lives here."""
